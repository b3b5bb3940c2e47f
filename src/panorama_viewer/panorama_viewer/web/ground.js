// The robot's path: two lines on level ground, as far apart as the robot is wide.

const COLOR = '#ffd84d';
const FAR_M = 10; // where they end
const MARKS_M = [1, 2, 5, FAR_M];
const POINTS = 60;

/** A sentence if the state does not say how wide the robot is and how high its cameras are. */
export function lackOfGround({ robot_width_m: width, camera_height_m: height }) {
  if (width && height) return '';
  return 'The path is not known: set robot_width_m and camera_height_m of the viewer';
}

export function ground({ sketch, state }) {
  if (lackOfGround(state)) return;
  const { robot_width_m: width, camera_height_m: height } = state;
  const sides = [-width / 2, width / 2];
  for (const x of sides) sketch.line(side(x, height), COLOR, { width: 3 });
  for (const z of MARKS_M) {
    const across = Array.from({ length: POINTS + 1 }, (_, i) => (i / POINTS - 0.5) * width);
    sketch.line(across.map((x) => [x, height, z]), COLOR);
    sketch.words([sides[1], height, z], `${z} m`, COLOR, 'left');
  }
}

/** Rays of the line `x` beside the cameras, from abeam of them to its end. */
function side(x, height) {
  const [begin, end] = [Math.PI / 2, Math.atan2(Math.abs(x), FAR_M)];
  return Array.from({ length: POINTS + 1 }, (_, i) => {
    const bearing = begin + (i / POINTS) * (end - begin);
    return [x, height, Math.abs(x) / Math.tan(bearing)];
  });
}
