/** The address of a 3D frame, and the quality this computer can draw. */
import { ROOT } from "../api/root";

export type Quality = "high" | "low";

interface Frame {
  key: string;
  uid: string | null;
  theme: "light" | "dark";
  quality: Quality;
  /** Of the frame, CSS pixels. */
  width: number;
  height: number;
}

/** As many pixels as software draws thirty times a second. */
const PIXELS = 580_000;
/** More pixels per CSS pixel than this cannot be told apart. Small frames need them, because edges are not smoothed. */
const FINEST = 1.5;

/** The address of the frame. Its socket uses the same origin, so nothing else is named here. */
export function viewUrl({ key, uid, theme, quality, width, height }: Frame): string {
  const query = new URLSearchParams({ theme, quality });
  if (uid !== null) query.set("select", uid);
  if (theme === "dark") query.set("darkMode", "");
  if (quality === "low") {
    const ratio = Math.min(FINEST, Math.sqrt(PIXELS / Math.max(1, width * height)));
    query.set("fixedDpr", ratio.toFixed(2));
  }
  return `${ROOT}/viser/${key}/?${query.toString()}`;
}

/** A unique, unguessable name of a frame, so that its picture and requests are its own. */
export function newKey(): string {
  const bytes = crypto.getRandomValues(new Uint8Array(16));
  return Array.from(bytes, byte => byte.toString(16).padStart(2, "0")).join("");
}

let found: Quality | null | undefined;

/** High with a graphics card, low in software, null if impossible. */
export function drawable(): Quality | null {
  if (found === undefined) found = probe();
  return found;
}

const SOFTWARE = /swiftshader|llvmpipe|software|basic render/i;

function probe(): Quality | null {
  try {
    const context = document.createElement("canvas").getContext("webgl2");
    if (!context) return null;
    const names = context.getExtension("WEBGL_debug_renderer_info");
    const renderer = String(context.getParameter(names ? names.UNMASKED_RENDERER_WEBGL : context.RENDERER));
    context.getExtension("WEBGL_lose_context")?.loseContext();
    return SOFTWARE.test(renderer) ? "low" : "high";
  } catch {
    return null;
  }
}
