// The buttons that do something on the robot's side.

const $ = (id) => document.getElementById(id);

export class Buttons {
  constructor(token) {
    this.token = token;
    this.needToken = false;
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
    const token = this.token.value || (this.needToken ? await this.token.ask() : '');
    if (this.needToken && !token) return;
    $(name).disabled = true;
    const reply = await fetch(`/${name}`, { method: 'POST', headers: { 'X-Token': token } })
      .catch(() => null);
    $(name).disabled = false;
    if (reply?.status === 403) {
      this.token.forget();
      this.needToken = true;
    }
    if (reply?.ok) say(await use(reply));
    else say(reply ? await reply.text() : 'The viewer does not answer');
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
export function say(sentence) {
  const element = $('answer');
  element.textContent = sentence;
  element.hidden = false;
  clearTimeout(say.timer);
  say.timer = setTimeout(() => { element.hidden = true; }, 3000 + 60 * sentence.length);
}
