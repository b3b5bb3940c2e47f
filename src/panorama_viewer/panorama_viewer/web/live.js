// The connection to the viewer: state and pictures; it comes back by itself.

const SILENT_MS = 1500; // the server tells its state twice a second
const MOST_SILENT_MS = 30000; // a slow link may need so long for one picture
const CONNECT_MS = 400; // a first packet that got lost would be sent again after a second
const MOST_CONNECT_MS = 4000; // also for a first connection
const ATTEMPTS = 10; // before a connection gets more time
const LOOK_MS = 100;
const REFUSED = 1008; // the close code for a token that is missing or wrong

export class Live {
  /**
   * `on` has the functions opened, state, picture (gives a promise: drawn), lost and refused;
   * `takesVideo` says whether H.264 is wanted.
   */
  constructor(token, takesVideo, on) {
    this.token = token;
    this.takesVideo = takesVideo;
    this.on = on;
    this.isRefused = false;
    this.attempts = 0;
    this.cuts = 0; // connections given up while they were open, since pictures came in good time
    this.connected_ms = MOST_CONNECT_MS; // what it took to connect
    this.open();
    setInterval(() => this.watch(), LOOK_MS);
    // Who does not look leaves the place and the link to others.
    document.addEventListener('visibilitychange', () => {
      if (document.hidden) this.socket.close();
      else this.watch();
    });
  }

  open() {
    this.socket?.close();
    this.heard = performance.now();
    this.isRefused = false;
    this.attempts += 1;
    this.orientation = null;
    this.on.opened();
    const offered = ['panorama', ...(this.takesVideo() ? ['h264'] : []),
      ...(this.token.value ? [`token.${this.token.value}`] : [])];
    const address = `${location.protocol.replace('http', 'ws')}//${location.host}/live`;
    const socket = new WebSocket(address, offered);
    socket.binaryType = 'arraybuffer';
    const begin = performance.now();
    socket.onopen = () => { this.connected_ms = performance.now() - begin; };
    socket.onmessage = ({ data }) => this.take(socket, data);
    socket.onclose = ({ code, reason }) => {
      if (socket !== this.socket) return;
      this.isRefused = code === REFUSED;
      this.on.lost(reason);
      if (this.isRefused) this.on.refused();
    };
    this.socket = socket;
  }

  /** Tell the viewer a word. */
  say(word, socket = this.socket) {
    if (socket.readyState === WebSocket.OPEN) socket.send(word);
  }

  async take(socket, data) {
    if (socket !== this.socket) return; // what comes late of a connection that was given up
    const isInTime = performance.now() - this.heard < SILENT_MS;
    this.heard = performance.now();
    this.attempts = 0;
    if (typeof data === 'string') {
      const message = JSON.parse(data);
      // What takes the pictures that follow to the level comes alone, in front of them.
      if (Object.hasOwn(message, 'orientation')) {
        this.orientation = message.orientation;
        return;
      }
      this.say('heard', socket);
      this.on.state(message);
      return;
    }
    if (isInTime) this.cuts = 0;
    try {
      await this.on.picture(data, this.orientation);
    } finally {
      // A picture that could not be drawn does not keep the next one away.
      this.say('drawn', socket);
    }
  }

  /** How long the connection may be silent, ms: it comes up at once where there is a link. */
  get patience() {
    if (this.socket.readyState === WebSocket.OPEN) {
      return Math.min(SILENT_MS * 2 ** this.cuts, MOST_SILENT_MS);
    }
    const usual = Math.max(CONNECT_MS, 2 * this.connected_ms);
    return Math.min(usual * 2 ** Math.floor(this.attempts / ATTEMPTS), MOST_CONNECT_MS);
  }

  /** Open a new connection in place of one that has ended, has gone silent or does not come up. */
  watch() {
    if (document.hidden || this.isRefused) return;
    if (performance.now() - this.heard < this.patience) return;
    if (this.socket.readyState === WebSocket.OPEN) {
      this.cuts += 1;
      this.on.lost('');
    }
    this.open();
  }
}
