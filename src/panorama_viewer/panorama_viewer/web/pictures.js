// Pictures as they come over the connection: JPEG, or H.264 where this browser decodes it.

// Any H.264 up to level 5.1; the colours are those of JPEG files, of narrow range.
const CONFIG = {
  codec: 'avc1.640033',
  optimizeForLatency: true,
  colorSpace: {
    matrix: 'smpte170m', primaries: 'smpte170m', transfer: 'smpte170m', fullRange: false,
  },
};
const JPEG = 0xff; // the first byte of a JPEG
const KEYFRAME = 1; // before H.264; 0 before what is no keyframe
const MOST_FAILURES = 3; // before H.264 is given up
const FORGIVEN_MS = 10000;

/** Why this browser cannot show H.264, in words; '' if it can. */
export async function obstacle() {
  if (!isSecureContext) return 'this page was not opened by https';
  if (!globalThis.VideoDecoder) return 'this browser has no WebCodecs';
  const { supported } = await VideoDecoder.isConfigSupported(CONFIG).catch(() => ({}));
  return supported ? '' : 'this browser does not decode H.264';
}

export class Pictures {
  /** `on` has the functions restart and giveUp: H.264 must begin anew, or is of no use here. */
  constructor(on) {
    this.on = on;
    this.waiting = []; // what takes each picture that is being decoded
    this.failures = [];
    this.reset();
  }

  /** Forget the stream so far: the next one begins with a keyframe. */
  reset() {
    if (this.decoder?.state === 'configured') this.decoder.close();
    this.decoder = null;
    for (const done of this.waiting.splice(0)) done(null);
  }

  /** The picture that bytes hold, at most `widest` px wide, to be closed; null if there is none. */
  async image(data, projection, widest) {
    const [first] = new Uint8Array(data, 0, 1);
    const isJpeg = first === JPEG;
    const source = isJpeg ? new Blob([data])
      : await this.decoded(new Uint8Array(data, 1), first === KEYFRAME);
    const narrowed = projection?.width > widest ? { resizeWidth: widest } : {};
    if (!source || (!isJpeg && !narrowed.resizeWidth)) return source;
    const bitmap = await createImageBitmap(source, narrowed).catch(() => null);
    if (!isJpeg) source.close();
    return bitmap;
  }

  decoded(data, isKey) {
    if (!this.decoder) {
      if (!isKey) return null;
      this.open();
    }
    const chunk = { type: isKey ? 'key' : 'delta', timestamp: 0, data };
    return new Promise((done) => {
      this.waiting.push(done);
      try {
        this.decoder.decode(new EncodedVideoChunk(chunk));
      } catch (error) {
        this.fail(error);
      }
    });
  }

  open() {
    this.decoder = new VideoDecoder({
      output: (frame) => this.waiting.shift()?.(frame),
      error: (error) => this.fail(error),
    });
    this.decoder.configure(CONFIG);
  }

  fail(error) {
    const now = performance.now();
    this.failures = [...this.failures.filter((time) => now - time < FORGIVEN_MS), now];
    this.reset();
    if (this.failures.length < MOST_FAILURES) this.on.restart();
    else this.on.giveUp(`this browser failed to decode H.264: ${error.message}`);
  }
}
