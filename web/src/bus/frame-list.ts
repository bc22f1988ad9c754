/** Elements of the monitor's list: only visible rows exist, and they are written without Preact. */
import { everyFrame } from "../plots/frames";
import type { FeedRow, FrameFeed } from "../telemetry/frame-feed";
import type { FrameLine } from "./frame-text";

interface Options {
  lineOf: (row: FeedRow) => FrameLine;
  /** The user scrolled back or selected a row: the list stops following. */
  onHold: () => void;
  /** The user scrolled to the end again. */
  onEnd: () => void;
  onChoose: (number: number | null) => void;
}

const DRAWS_PER_S = 10;
const CELLS = ["time", "direction", "route", "body", "id", "size"] as const;

interface Shown {
  element: HTMLElement;
  cells: Record<(typeof CELLS)[number], HTMLElement>;
  head: HTMLElement;
  text: HTMLElement;
  /** Number of the row it shows, -1 for none. */
  number: number;
}

export class FrameList {
  #scroller: HTMLElement;
  #spacer: HTMLElement;
  #feed: FrameFeed;
  #options: Options;
  #pool: Shown[] = [];
  #height = 26;
  /** A finger or the mouse button is down. */
  #pressed = false;
  /** Last scroll position set by this list itself. */
  #ownTop = -1;
  #drawn = "";
  #chosen: number | null = null;
  #end: () => void;
  #resize: ResizeObserver;
  #listeners = new AbortController();

  constructor(scroller: HTMLElement, feed: FrameFeed, options: Options) {
    this.#scroller = scroller;
    this.#feed = feed;
    this.#options = options;
    this.#spacer = document.createElement("div");
    this.#spacer.className = "f-spacer";
    this.#spacer.setAttribute("role", "presentation");
    scroller.append(this.#spacer);
    this.#end = everyFrame(scroller, DRAWS_PER_S, () => this.draw());
    this.#resize = new ResizeObserver(() => this.#measure());
    this.#resize.observe(scroller);
    this.#measure();
    this.#listen();
  }

  destroy(): void {
    this.#end();
    this.#resize.disconnect();
    this.#listeners.abort();
    this.#spacer.remove();
  }

  /** Rewrites all visible rows by `lineOf`. */
  refresh(): void {
    for (const one of this.#pool) one.number = -1;
    this.#drawn = "";
    this.draw();
  }

  /** Selects a row; null selects none. */
  choose(number: number | null): void {
    if (number === this.#chosen) return;
    this.#chosen = number;
    this.refresh();
  }

  draw(): void {
    const { first, end, held } = this.#feed;
    const box = this.#scroller;
    const count = end - first;
    if (!held && this.#pressed) return;
    this.#spacer.style.height = `${count * this.#height}px`;
    if (!held) this.#scrollTo(box.scrollHeight);
    const top = Math.max(0, Math.floor(box.scrollTop / this.#height));
    const room = Math.ceil(box.clientHeight / this.#height) + 1;
    const state = `${first} ${end} ${top} ${room}`;
    if (state === this.#drawn) return;
    this.#drawn = state;
    box.setAttribute("aria-rowcount", String(count));
    this.#grow(room);
    const from = first + top;
    const to = Math.min(end, from + room);
    const size = this.#pool.length;
    for (let number = from; number < to; number++) this.#show(this.#pool[number % size], number, first);
    for (const one of this.#pool) {
      const seen = one.number >= from && one.number < to;
      if (one.element.hidden === seen) one.element.hidden = !seen;
    }
  }

  #measure(): void {
    const height = Number.parseFloat(getComputedStyle(this.#scroller).getPropertyValue("--frame-row"));
    this.#height = Number.isFinite(height) && height > 0 ? height : this.#height;
    this.refresh();
    // A shorter box may hide the selected row; a taller one may now be at its end.
    if (this.#chosen !== null) this.#reveal(this.#chosen);
    this.#ended();
  }

  #grow(room: number): void {
    if (this.#pool.length >= room) return;
    // Which element shows which row depends on how many there are.
    for (const one of this.#pool) one.number = -1;
    while (this.#pool.length < room) {
      const made = make();
      this.#pool.push(made);
      this.#spacer.append(made.element);
    }
  }

  #show(one: Shown | undefined, number: number, first: number): void {
    if (!one) return;
    one.element.style.transform = `translateY(${(number - first) * this.#height}px)`;
    if (one.number === number) return;
    const row = this.#feed.at(number);
    if (!row) return;
    const line = this.#options.lineOf(row);
    one.number = number;
    one.element.id = `frame-${number}`;
    one.element.dataset.kind = line.kind;
    one.element.setAttribute("aria-rowindex", String(number - first + 1));
    one.element.setAttribute("aria-selected", String(number === this.#chosen));
    one.cells.time.textContent = line.time;
    one.cells.direction.textContent = line.direction;
    one.cells.route.textContent = line.route;
    one.head.textContent = line.head;
    one.text.textContent = line.text;
    one.text.className = line.mono ? "mono" : "";
    one.cells.id.textContent = line.id;
    one.cells.size.textContent = line.size;
  }

  #listen(): void {
    const box = this.#scroller;
    const { signal } = this.#listeners;
    const passive = { signal, passive: true };
    box.addEventListener("scroll", () => this.#scrolled(), passive);
    box.addEventListener(
      "wheel",
      event => {
        if (event.deltaY < 0 && box.scrollHeight > box.clientHeight) this.#options.onHold();
      },
      passive,
    );
    // The list does not move during a press: a press that ends on another row than it began on is not a click.
    const touch = (on: boolean) => () => {
      this.#pressed = on;
    };
    const release = ({ pointerType }: PointerEvent) => {
      if (pointerType === "mouse") this.#pressed = false;
    };
    box.addEventListener("touchstart", touch(true), passive);
    box.addEventListener("touchend", touch(false), passive);
    box.addEventListener("touchcancel", touch(false), passive);
    box.addEventListener(
      "pointerdown",
      // Not on the scroll bar, where some browsers report no release.
      event => {
        if (event.pointerType === "mouse" && event.button === 0 && rowAt(event)) this.#pressed = true;
      },
      passive,
    );
    window.addEventListener("pointerup", release, passive);
    window.addEventListener("pointercancel", release, passive);
    box.addEventListener(
      "click",
      event => {
        const element = rowAt(event);
        const found = this.#pool.find(one => one.element === element);
        if (!found || !this.#hasMore(found.number)) return;
        this.#options.onChoose(found.number === this.#chosen ? null : found.number);
      },
      { signal },
    );
    box.addEventListener("keydown", event => this.#key(event), { signal });
  }

  #scrolled(): void {
    const own = this.#scroller.scrollTop === this.#ownTop;
    if (!own && this.#below() > this.#height) this.#options.onHold();
    else this.#ended();
    this.draw();
  }

  /** Scrolls, and marks the position as set by this list. */
  #scrollTo(top: number): void {
    this.#scroller.scrollTop = top;
    this.#ownTop = this.#scroller.scrollTop;
  }

  #ended(): void {
    if (this.#below() < 2) this.#options.onEnd();
  }

  /** Height of the list below the visible part. */
  #below(): number {
    const box = this.#scroller;
    return box.scrollHeight - box.clientHeight - box.scrollTop;
  }

  #key(event: KeyboardEvent): void {
    const { first, end } = this.#feed;
    if (end === first) return;
    const last = end - 1;
    const present = this.#chosen ?? (event.key === "ArrowDown" ? last : end);
    const steps: Record<string, number> = {
      ArrowUp: present - 1,
      ArrowDown: present + 1,
      Home: first,
      End: last,
    };
    const next = steps[event.key];
    if (next === undefined) return;
    event.preventDefault();
    const step = next < present ? -1 : 1;
    let number = Math.min(last, Math.max(first, next));
    while (number > first && number < last && !this.#hasMore(number)) number += step;
    if (!this.#hasMore(number)) return;
    this.#options.onChoose(number);
    this.#reveal(number);
  }

  /** Whether a row has details: a gap has none. */
  #hasMore(number: number): boolean {
    const row = this.#feed.at(number);
    return row !== undefined && row.kind !== "gap";
  }

  #reveal(number: number): void {
    const box = this.#scroller;
    const top = (number - this.#feed.first) * this.#height;
    if (top < box.scrollTop) this.#scrollTo(top);
    else if (top + this.#height > box.scrollTop + box.clientHeight)
      this.#scrollTo(top + this.#height - box.clientHeight);
    box.setAttribute("aria-activedescendant", `frame-${number}`);
  }
}

function rowAt(event: Event): HTMLElement | null {
  return (event.target as HTMLElement).closest<HTMLElement>(".f-row");
}

function make(): Shown {
  const element = document.createElement("div");
  element.className = "f-row";
  element.setAttribute("role", "row");
  const cells = Object.fromEntries(
    CELLS.map(name => {
      const cell = document.createElement("span");
      cell.className = `f-${name}`;
      cell.setAttribute("role", "gridcell");
      element.append(cell);
      return [name, cell];
    }),
  ) as Shown["cells"];
  const head = document.createElement("b");
  const text = document.createElement("span");
  cells.body.append(head, " ", text);
  return { element, cells, head, text, number: -1 };
}
