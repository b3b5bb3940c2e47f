// A gamepad: the right stick looks around, and pressing it looks straight ahead again.

const [X, Y, PRESS] = [2, 3, 11]; // of the right stick in the W3C's standard mapping
const REST = 0.15; // no stick comes back to exactly 0
const FASTEST = 1; // of the view's width a second
const LONGEST_S = 0.1; // between two looks at the gamepad

/** Follow the gamepads of the standard mapping; of others nobody knows what an axis is. */
export function stickTo(viewer) {
  let [last, wasPressed, isFollowed] = [0, false, false];
  const follow = (now) => {
    const pads = [...navigator.getGamepads()].filter((pad) => pad?.mapping === 'standard');
    isFollowed = pads.length > 0;
    if (!isFollowed) return;
    requestAnimationFrame(follow);
    const seconds = Math.min((now - last) / 1000, LONGEST_S);
    last = now;
    for (const { axes } of pads) {
      const [right, down] = deflection(axes[X], axes[Y]);
      if (right || down) viewer.step(right * FASTEST * seconds, -down * FASTEST * seconds);
    }
    const isPressed = pads.some(({ buttons }) => buttons[PRESS]?.pressed);
    if (isPressed && !wasPressed) viewer.reset();
    wasPressed = isPressed;
  };
  window.addEventListener('gamepadconnected', () => {
    if (!isFollowed) requestAnimationFrame(follow);
    isFollowed = true;
  });
}

/** [right, down] from 0 at rest to 1, gentle at first. */
function deflection(x, y) {
  const length = Math.hypot(x, y);
  if (!(length > REST)) return [0, 0];
  const share = ((Math.min(length, 1) - REST) / (1 - REST)) ** 2 / length;
  return [x * share, y * share];
}
