// The connection to the viewer: state and pictures; it comes back by itself.

const SILENT_MS = 4000; // the server tells its state twice a second
const RETRY_MS = 1000;

export class Live {
  /** `on` has the functions state, picture (gives a promise: drawn) and lost. */
  constructor(on) {
    this.on = on;
    this.open();
    setInterval(() => this.watch(), RETRY_MS);
  }

  open() {
    this.heard = performance.now();
    const socket = new WebSocket(`${location.protocol.replace('http', 'ws')}//${location.host}/live`);
    socket.binaryType = 'blob';
    socket.onmessage = ({ data }) => this.take(socket, data);
    socket.onclose = ({ reason }) => socket === this.socket && this.on.lost(reason);
    this.socket = socket;
  }

  async take(socket, data) {
    this.heard = performance.now();
    if (typeof data === 'string') {
      this.on.state(JSON.parse(data));
      return;
    }
    await this.on.picture(data);
    if (socket.readyState === WebSocket.OPEN) socket.send('drawn');
  }

  /** Give up a connection that has gone silent, and open a new one for one that has ended. */
  watch() {
    if (this.socket.readyState === WebSocket.CLOSED) this.open();
    else if (performance.now() - this.heard > SILENT_MS) {
      this.socket.close();
      this.on.lost('');
      this.open();
    }
  }
}
