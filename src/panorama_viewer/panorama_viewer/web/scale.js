// The bearing scale under the picture, and the bearing under the pointer.

import { nextTo } from '/geometry.js';

const STEPS = [1, 2, 5, 10, 15, 30, 45, 90];
const ROOM = 3.8; // heights of the text that a label needs in width
const DEGREE = Math.PI / 180;

export class Scale {
  constructor(element) {
    this.element = element;
    this.canvas = element.querySelector('canvas');
    this.label = element.querySelector('output');
    this.pen = this.canvas.getContext('2d');
  }

  /**
   * Draw ticks from one bearing to another; `place` gives the x of a bearing in CSS px, or null
   * where it is not shown.
   */
  draw(place, from, to) {
    const { pen, canvas } = this;
    const width = canvas.clientWidth;
    pen.setTransform(devicePixelRatio, 0, 0, devicePixelRatio, 0, 0);
    pen.clearRect(0, 0, width, canvas.clientHeight);
    const style = getComputedStyle(canvas);
    pen.fillStyle = pen.strokeStyle = style.color;
    this.size = parseFloat(style.fontSize);
    pen.font = `500 ${this.size}px ${style.fontFamily}`;
    pen.textAlign = 'center';
    const ticks = [];
    for (let degrees = Math.ceil(from / DEGREE); degrees <= to / DEGREE; degrees++) {
      const x = place(degrees * DEGREE);
      if (x !== null && x >= 0 && x <= width) ticks.push([degrees, x]);
    }
    const step = STEPS.find((s) => gap(ticks, s) >= ROOM * this.size) ?? STEPS.at(-1);
    const fine = STEPS.find((s) => step % s === 0 && gap(ticks, s) >= 5) ?? step;
    pen.beginPath();
    for (const [degrees, x] of ticks) {
      if (degrees % fine) continue;
      pen.moveTo(x, 0);
      pen.lineTo(x, degrees % step ? 4 : 8);
      if (degrees % step || x < 1.2 * this.size || x > width - 1.2 * this.size) continue;
      pen.fillText(inDegrees(degrees * DEGREE), x, this.size + 10);
    }
    pen.stroke();
  }

  /** Show what lies at x, CSS px from the left edge; null if that is beside the scale. */
  point(x, [bearing, elevation]) {
    const degrees = nextTo(0, bearing) / DEGREE;
    const height = aside(elevation / DEGREE, 'down', 'up');
    this.label.value = `${aside(degrees, 'left', 'right')} · ${height}`;
    this.label.dataset.bearingDeg = degrees.toFixed(2);
    const half = this.label.offsetWidth / 2;
    const width = this.canvas.clientWidth;
    const at = x ?? width / 2;
    this.label.style.left = `${Math.min(Math.max(at, half), Math.max(width - half, half))}px`;
    this.element.style.setProperty('--at', x === null ? '-9px' : `${x}px`);
  }
}

/** A bearing in words: whole degrees from −179° to 180°. */
export function inDegrees(bearing) {
  const degrees = Math.round(nextTo(0, bearing) / DEGREE);
  return `${degrees < 0 && degrees > -180 ? '−' : ''}${Math.abs(degrees)}°`;
}

/** Smallest distance in px between neighbouring multiples of `step`. */
function gap(ticks, step) {
  const places = ticks.filter(([degrees]) => degrees % step === 0).map(([, x]) => x);
  return Math.min(...places.slice(1).map((x, i) => x - places[i]), Infinity);
}

function aside(degrees, negative, positive) {
  const rounded = Math.abs(degrees).toFixed(1);
  if (rounded === '0.0' || rounded === '180.0') return `${rounded}°`; // on neither side
  return `${rounded}° ${degrees < 0 ? negative : positive}`;
}
