/** The line at the present moment of a recording: an overlay, so that the plot is not drawn again. */

export class Playhead {
  #line = document.createElement("div");

  constructor() {
    this.#line.className = "playhead";
    this.#line.hidden = true;
  }

  /** Place it over a face at a share (0 to 1) of its width; hidden if outside or null. */
  place(face: HTMLElement, part: number | null): void {
    const seen = part !== null && part >= 0 && part <= 1;
    if (seen && this.#line.parentElement !== face) face.append(this.#line);
    this.#line.hidden = !seen;
    if (seen) this.#line.style.transform = `translateX(${(part * face.clientWidth).toFixed(1)}px)`;
  }
}
