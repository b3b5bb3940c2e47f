// The bearings of the picture's left and right edge, under it.

import { inDegrees } from '/scale.js';

const outputs = ['left', 'right'].map((side) => {
  const output = document.createElement('output');
  output.className = 'edge';
  output.id = `${side}-edge`;
  return output;
});
document.getElementById('scale').append(...outputs);

export function edges({ screen }) {
  const { clientWidth: width, clientHeight: height } = screen.shown;
  for (const [i, x] of [0, width].entries()) {
    const [bearing] = screen.angles(screen.shown, x, height / 2);
    outputs[i].value = inDegrees(bearing);
  }
}
