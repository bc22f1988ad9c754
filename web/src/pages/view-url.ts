/** Owns the address of the 3D view and how well it may be drawn on this machine. */

export type Quality = "high" | "low";

interface Wish {
  uid: string;
  theme: "light" | "dark";
  quality: Quality;
}

/** The address of the frame. Its socket goes to the same origin, so nothing else is named here. */
export function viewUrl({ uid, theme, quality }: Wish): string {
  const query = new URLSearchParams({ theme, quality, select: uid });
  if (theme === "dark") query.set("darkMode", "");
  if (quality === "low") query.set("fixedDpr", "1");
  return `/viser/?${query.toString()}`;
}

let found: Quality | null | undefined;

/** High where a graphics card draws, low where the processor does, null where nothing can. */
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
