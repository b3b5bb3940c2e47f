// On the scale: where the robot's own forward direction is, and how wide the robot is.

import { nextTo } from '/geometry.js';

const AHEAD = 0; // rad: bearings count from the robot's forward direction
const WIDE_AT_M = 2; // the bar is as wide as the robot so far ahead

export function heading({ screen, state }) {
  const { canvas, pen, size } = screen.scale;
  const width = canvas.clientWidth;
  const ahead = nextTo(screen.projection.middle, AHEAD);
  const x = screen.column(ahead);
  pen.fillStyle = getComputedStyle(canvas).getPropertyValue('--ahead');
  if (x === null || x < 0 || x > width) {
    turnBack(screen);
    return;
  }
  const half = Math.atan2(state.robot_width_m / 2, WIDE_AT_M);
  const [left, right] = [ahead - half, ahead + half].map((bearing) => screen.column(bearing));
  if (half && left !== null && right !== null) pen.fillRect(left, 0, right - left, size / 3);
  triangle(pen, [[x, 0], [x - size / 2, size * 0.8], [x + size / 2, size * 0.8]]);
}

/** Show at the nearer edge how far to turn. */
function turnBack({ scale: { canvas, pen, size }, middle }) {
  const right = nextTo(0, AHEAD - middle);
  const side = right < 0 ? 1 : -1; // which way leads inwards
  const edge = right < 0 ? 0 : canvas.clientWidth;
  const y = size * 0.65 + 10; // the middle of the labels
  const text = `${Math.abs((right / Math.PI) * 180).toFixed(0)}°`;
  const room = pen.measureText(text).width + size * 2;
  pen.clearRect(Math.min(edge, edge + side * room), 0, room, canvas.clientHeight);
  triangle(pen, [[edge + side * 2, y], [edge + side * size, y - size / 2],
    [edge + side * size, y + size / 2]]);
  pen.textAlign = right < 0 ? 'left' : 'right';
  pen.fillText(text, edge + side * size * 1.4, size + 10);
}

function triangle(pen, corners) {
  pen.beginPath();
  for (const corner of corners) pen.lineTo(...corner);
  pen.fill();
}
