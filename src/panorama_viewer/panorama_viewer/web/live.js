// The connection to the viewer: state and pictures; it comes back by itself.

const SILENT_MS = 4000; // the server tells its state twice a second
const RETRY_MS = 1000;
const REFUSED = 1008; // the close code for a token that is missing or wrong

export class Live {
  /** `on` has the functions state, picture (gives a promise: drawn), lost and refused. */
  constructor(token, on) {
    this.token = token;
    this.on = on;
    this.isRefused = false;
    this.open();
    setInterval(() => this.watch(), RETRY_MS);
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
    const offered = ['panorama', ...(this.token.value ? [`token.${this.token.value}`] : [])];
    const address = `${location.protocol.replace('http', 'ws')}//${location.host}/live`;
    const socket = new WebSocket(address, offered);
    socket.binaryType = 'blob';
    socket.onmessage = ({ data }) => this.take(socket, data);
    socket.onclose = ({ code, reason }) => {
      if (socket !== this.socket) return;
      this.isRefused = code === REFUSED;
      this.on.lost(reason);
      if (this.isRefused) this.on.refused();
    };
    this.socket = socket;
  }

  async take(socket, data) {
    this.heard = performance.now();
    if (typeof data === 'string') {
      this.on.state(JSON.parse(data));
      return;
    }
    try {
      await this.on.picture(data);
    } finally {
      // A picture that could not be drawn does not keep the next one away.
      if (socket.readyState === WebSocket.OPEN) socket.send('drawn');
    }
  }

  /** Give up a connection that has gone silent, and open a new one for one that has ended. */
  watch() {
    if (document.hidden || this.isRefused) return;
    if (this.socket.readyState >= WebSocket.CLOSING) this.open();
    else if (performance.now() - this.heard > SILENT_MS) {
      this.on.lost('');
      this.open();
    }
  }
}
