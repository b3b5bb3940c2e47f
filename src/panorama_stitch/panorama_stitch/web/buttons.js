// The buttons that do something on the robot's side, and the token that they may need.

const $ = (id) => document.getElementById(id);
const KEY = 'token';

export class Buttons {
  constructor() {
    this.needToken = false;
    const given = new URLSearchParams(location.hash.slice(1)).get(KEY);
    if (given) {
      sessionStorage.setItem(KEY, given);
      history.replaceState(null, '', location.pathname);
    }
    $('calibrate').addEventListener('click', () => this.press('calibrate', calibrated));
    $('snapshot').addEventListener('click', () => this.press('snapshot', save));
    $('fullscreen').hidden = !document.fullscreenEnabled;
    $('fullscreen').addEventListener('click', () => {
      if (document.fullscreenElement) document.exitFullscreen();
      else document.documentElement.requestFullscreen();
    });
  }

  /** Ask the viewer for what a button stands for, and hand a good reply on. */
  async press(name, use) {
    const token = await this.token();
    if (token === null) return;
    $(name).disabled = true;
    const reply = await fetch(`/${name}`, { method: 'POST', headers: { 'X-Token': token } })
      .catch(() => null);
    $(name).disabled = false;
    if (reply?.status === 403) sessionStorage.removeItem(KEY);
    if (reply?.ok) say(await use(reply));
    else say(reply ? await reply.text() : 'The viewer does not answer');
  }

  /** Give the token, '' if none is needed, null if nobody gives one. */
  async token() {
    if (!this.needToken) return '';
    const known = sessionStorage.getItem(KEY);
    if (known) return known;
    const dialog = $('ask');
    dialog.returnValue = '';
    dialog.showModal();
    await new Promise((closed) => { dialog.onclose = closed; });
    const typed = $('token').value.trim();
    if (dialog.returnValue !== 'use' || !typed) return null;
    sessionStorage.setItem(KEY, typed);
    return typed;
  }
}

const calibrated = (reply) => reply.text();

async function save(reply) {
  const link = document.createElement('a');
  link.href = URL.createObjectURL(await reply.blob());
  link.download = `panorama_${new Date().toISOString().replace(/[-:]|\..*/g, '')}.jpg`;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
  return `Saved as ${link.download}`;
}

/** Show a sentence for as long as it takes to read. */
function say(sentence) {
  const element = $('answer');
  element.textContent = sentence;
  element.hidden = false;
  clearTimeout(say.timer);
  say.timer = setTimeout(() => { element.hidden = true; }, 3000 + 60 * sentence.length);
}
