/** A plot as an image file: its lanes stacked below a title. */
import { palette } from "./palette";

const HEAD_PX = 30;

/** A PNG of the lanes as drawn now; null if nothing is drawn. */
export async function pictureOf(
  lanes: readonly (HTMLCanvasElement | null)[],
  title: string,
  detail: string,
): Promise<Blob | null> {
  const drawn = lanes.filter(one => one !== null && one.width > 0) as HTMLCanvasElement[];
  if (drawn.length === 0) return null;
  const ratio = devicePixelRatio || 1;
  const colours = palette();
  const file = document.createElement("canvas");
  file.width = Math.max(...drawn.map(one => one.width));
  file.height = drawn.reduce((sum, one) => sum + one.height, HEAD_PX * ratio);
  const ctx = file.getContext("2d");
  if (!ctx) return null;
  ctx.fillStyle = colours.panel;
  ctx.fillRect(0, 0, file.width, file.height);
  ctx.textBaseline = "middle";
  ctx.fillStyle = colours.ink;
  ctx.font = `600 ${14 * ratio}px ${colours.font}`;
  ctx.fillText(title, 12 * ratio, (HEAD_PX / 2) * ratio);
  ctx.fillStyle = colours.ink2;
  ctx.font = `${12 * ratio}px ${colours.font}`;
  ctx.textAlign = "right";
  ctx.fillText(detail, file.width - 12 * ratio, (HEAD_PX / 2) * ratio);
  let top = HEAD_PX * ratio;
  for (const one of drawn) {
    ctx.drawImage(one, 0, top);
    top += one.height;
  }
  return new Promise(resolve => file.toBlob(resolve, "image/png"));
}
