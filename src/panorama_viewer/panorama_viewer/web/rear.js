// The view straight back, in a place of its own, as in a mirror: what is left stays left.

import { View } from '/geometry.js';
import { Look } from '/look.js';

const canvas = document.querySelector('#rear canvas');
const view = Object.assign(new View(), { yaw: Math.PI, fov: (110 / 180) * Math.PI });
let look = null; // only those who want it pay for it

export function rear({ screen }) {
  if (!screen.look) return; // this browser cannot
  look ??= new Look(canvas);
  look.draw(screen.bitmap, screen.projection, view);
}
