// What the viewer knows, in words: the line at the top, the problems, the veil over a dead picture.

import { say } from '/buttons.js';

const $ = (id) => document.getElementById(id);
const SLOW = 0.8; // of the rate: below it this browser does not keep up
const WINDOW_MS = 2000;
const LATE_MS = 150; // control gets harder above it
const TOO_LATE_MS = 300; // and is lost

export class Status {
  constructor() {
    this.state = {};
    this.lost = 'connecting to the viewer';
    this.obstacle = ''; // why this browser cannot show H.264
    this.drawn = []; // when pictures were drawn, ms
    setInterval(() => this.show(), 250);
    // Fingers cannot point at a title.
    $('format').addEventListener('click', () => $('format').title && say($('format').title));
  }

  /** Note that a picture was drawn. */
  picture() {
    const now = performance.now();
    this.drawn = [...this.drawn.filter((time) => now - time < WINDOW_MS), now];
    if ($('condition').dataset.level === 'error') this.show();
  }

  take(state) {
    this.state = state;
    this.lost = '';
    this.show();
  }

  lose(reason) {
    this.lost = reason || 'no connection to the viewer';
    this.show();
  }

  show() {
    const silent_s = (performance.now() - this.drawn.at(-1)) / 1000;
    const isDead = !(silent_s < (this.state.stale_after_s ?? 1));
    const { problems = [] } = this.state;
    let words = problems.length ? 'Live, with problems' : 'Live';
    if (isDead) words = silent_s ? `No picture for ${length(silent_s)}` : 'Waiting for a picture';
    const worst = ['error', 'warning'].find((level) => problems.some((p) => p.level === level));
    this.condition(words, isDead ? 'error' : worst ?? 'ok');
    document.body.toggleAttribute('data-dead', isDead);
    $('veil').hidden = !isDead;
    $('veil').textContent = this.lost ? `${words}: ${this.lost}` : words;
    this.figures(isDead);
    this.problems(problems);
  }

  condition(words, level) {
    $('condition').dataset.level = level;
    $('condition').querySelector('b').textContent = words;
  }

  figures(isDead) {
    const { rate_hz: rate, delay_ms, way_ms, skew_ms: skew, overlaps } = this.state;
    const span = this.drawn.at(-1) - this.drawn[0];
    const here = span ? ((this.drawn.length - 1) / span) * 1000 : 0;
    const slow = here < SLOW * rate ? `, ${here.toFixed(0)} here` : '';
    $('rate').textContent = isDead || !rate ? '–' : `${rate.toFixed(0)}/s${slow}`;
    const total_ms = isDead || delay_ms == null ? null : delay_ms + way_ms;
    $('delay').textContent = total_ms === null ? '–' : delay(total_ms);
    $('delay').dataset.level = total_ms > TOO_LATE_MS ? 'error' : total_ms > LATE_MS ? 'warning' : '';
    $('format').textContent = isDead ? '–' : this.state.format ?? '–';
    $('format').title = this.obstacle || this.state.no_video || '';
    $('skew').textContent = skew == null ? '–' : `${skew.toFixed(0)} ms`;
    $('overlap').textContent = overlaps?.map(confidence).join(', ') || '–';
    $('overlap').title = overlaps?.map(({ words }) => words).join('\n') ?? '';
  }

  problems(problems) {
    const lines = problems.map(({ level, text }) => {
      const line = document.createElement('li');
      line.dataset.level = level;
      line.textContent = text;
      return line;
    });
    const words = problems.map(({ text }) => text).join();
    if (words !== this.words) $('problems').replaceChildren(...lines);
    this.words = words;
  }
}

function length(seconds) {
  if (seconds < 60) return `${Math.floor(seconds)} s`;
  return seconds < 3600 ? `${Math.floor(seconds / 60)} min` : `${Math.floor(seconds / 3600)} h`;
}

function delay(ms) {
  if (ms < -10) return 'clocks differ';
  return ms < 1000 ? `${Math.max(ms, 0).toFixed(0)} ms` : length(ms / 1000);
}

const confidence = ({ found, confidence: value }) => (found ? value?.toFixed(2) ?? '?' : 'none');
