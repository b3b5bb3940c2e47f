"""The page in Chromium: what time is painted in what it shows, and when it is shown.

`delay_page.py URL SECONDS jpeg|h264 PLACES` prints a line of JSON when the first picture is there
and another one at the end: for each picture drawn, when it was painted, received, decoded and
drawn, ms since the epoch, and its bytes; and the ages, ms, of what screenshots show at their end.
PLACES is JSON: the row and the columns of the painted blocks, as shares of the panorama.
"""

import base64
import json
import sys
import time

import cv2
import numpy as np
from chromium import chromium

from fisheye_testing.painted_time import WRAP_MS, age_ms, read
from fisheye_testing.waiting import wait_for

_SHOTS = 20
_FIRST_S = 60.0
_PROBE = """
const shown = [];
window.shown = shown;
const now = () => performance.timeOrigin + performance.now();
const received = [];
if (TAKE_AWAY) delete window.VideoDecoder;
else if (window.VideoDecoder) {
  const Plain = VideoDecoder;
  window.VideoDecoder = class extends Plain {
    constructor({ output, error }) {
      super({ error, output: (frame) => {
        [frame.receivedAt, frame.coded] = received.shift();
        frame.decodedAt = now();
        output(frame);
      } });
    }
    decode(chunk) { received.push([now(), chunk.byteLength]); super.decode(chunk); }
    close() { received.length = 0; super.close(); }
  };
}
const plainBitmap = window.createImageBitmap;
window.createImageBitmap = async (source, ...rest) => {
  const at = now();
  const bitmap = await plainBitmap(source, ...rest);
  const { receivedAt = at, size, coded = size } = source;
  Object.assign(bitmap, { receivedAt, coded, decodedAt: now() });
  return bitmap;
};
const plainDraw = CanvasRenderingContext2D.prototype.drawImage;
let last = null;
CanvasRenderingContext2D.prototype.drawImage = function draw(image, ...rest) {
  plainDraw.call(this, image, ...rest);
  if (this.canvas.id !== 'whole' || image === last || !window.columns) return;
  last = image;
  const at = now();
  const { width, height } = this.canvas;
  const row = Math.round(window.row * height);
  const { data } = this.getImageData(0, row - 1, width, 3);
  const levels = window.columns.map((share) => {
    const x = Math.floor(share * width);
    return [0, 1, 2].reduce((sum, y) => sum + data[4 * (y * width + x) + 1], 0) / 3;
  });
  shown.push({ levels, received: image.receivedAt, decoded: image.decodedAt, drawn: at,
    bytes: image.coded });
};
"""


def main() -> None:
    """Look at the page, and print."""
    url, seconds, kind, places = sys.argv[1:]
    row, columns = json.loads(places)
    driver = chromium('disable-gpu', 'window-size=1300,800')
    try:
        probe = _PROBE.replace('TAKE_AWAY', str(kind == 'jpeg').lower())
        probe += f'window.row = {row}; window.columns = {columns};'
        driver.execute_cdp_cmd('Page.addScriptToEvaluateOnNewDocument', {'source': probe})
        driver.get(url)
        wait_for(lambda: driver.execute_script('return shown.length > 30'), _FIRST_S, 'pictures')
        print(json.dumps({'format': driver.find_element('id', 'format').text}), flush=True)
        driver.execute_script('shown.length = 0')
        end_s = time.monotonic() + float(seconds)
        told = []
        while time.monotonic() < end_s:
            time.sleep(1.0)
            told.append(driver.find_element('id', 'delay').text)
        pictures = driver.execute_script('return shown')
        shots = [age for _ in range(_SHOTS) if (age := screenshot_age_ms(driver, row, columns))]
        answer = {'pictures': [painted(each) for each in pictures], 'shots': shots, 'told': told}
        print(json.dumps(answer), flush=True)
    finally:
        driver.quit()


def painted(picture: dict) -> dict:
    """Put the painted time, ms since the epoch, in the place of the grey levels."""
    time_ms = read(picture.pop('levels'))
    if time_ms is not None:
        drawn = int(picture['drawn'])
        time_ms = drawn - round(age_ms(time_ms, drawn * 1_000_000))
    return {**picture, 'painted': time_ms}


def screenshot_age_ms(driver, row: float, columns: list[float]) -> float | None:
    """Return how old, once a screenshot is taken, is what it shows; None if it is torn."""
    shot = driver.execute_cdp_cmd('Page.captureScreenshot', {'format': 'jpeg', 'quality': 60})
    now_ns = time.time_ns()
    pixels = cv2.imdecode(np.frombuffer(base64.b64decode(shot['data']), np.uint8), 1)
    box = driver.find_element('id', 'whole').rect
    y = round(box['y'] + row * box['height'])
    x = [round(box['x'] + share * box['width']) for share in columns]
    time_ms = read(pixels[y - 1 : y + 2, x].mean(axis=(0, 2)))
    return None if time_ms is None else age_ms(time_ms % WRAP_MS, now_ns)


if __name__ == '__main__':
    main()
