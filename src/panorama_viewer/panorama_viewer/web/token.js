// The token that looking and the buttons may need: from the address, or typed.

import { store } from '/store.js';

const $ = (id) => document.getElementById(id);
const KEY = 'token';

/** What can be in a token: anything else cannot be in a WebSocket's request. */
const cleaned = (text) => text.replace(/[^\w-]/g, '');

export class Token {
  /** `given` is called when somebody has typed one. */
  constructor(given) {
    this.given = given;
    this.asking = null;
    this.store = store('sessionStorage');
    this.take();
    window.addEventListener('hashchange', () => this.take() && this.given());
  }

  /** Take the token out of the address, where others could read it. */
  take() {
    const token = cleaned(new URLSearchParams(location.hash.slice(1)).get(KEY) ?? '');
    if (!token) return false;
    this.store.setItem(KEY, token);
    history.replaceState(null, '', location.pathname);
    return true;
  }

  /** The token, '' if none is known. */
  get value() {
    return this.store.getItem(KEY) ?? '';
  }

  /** Forget a token that was refused. */
  forget() {
    this.store.removeItem(KEY);
  }

  /** Ask for the token; gives '' if nobody types one. */
  ask() {
    this.asking ??= this.dialog().finally(() => { this.asking = null; });
    return this.asking;
  }

  async dialog() {
    const dialog = $('ask');
    dialog.returnValue = '';
    $('token').value = '';
    dialog.showModal();
    await new Promise((closed) => { dialog.onclose = closed; });
    const typed = cleaned($('token').value);
    if (dialog.returnValue !== 'use' || !typed) return '';
    this.store.setItem(KEY, typed);
    this.given();
    return typed;
  }
}
