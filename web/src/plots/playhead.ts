/** The line across a plot at the moment that is looked at: laid over it, so that nothing is drawn anew. */

export class Playhead {
  #line = document.createElement("div");

  constructor() {
    this.#line.className = "playhead";
    this.#line.hidden = true;
  }

  /** Over a face, so far across it (0 to 1); nowhere when that is outside or there is none. */
  place(face: HTMLElement, part: number | null): void {
    const seen = part !== null && part >= 0 && part <= 1;
    if (seen && this.#line.parentElement !== face) face.append(this.#line);
    this.#line.hidden = !seen;
    if (seen) this.#line.style.transform = `translateX(${(part * face.clientWidth).toFixed(1)}px)`;
  }
}
