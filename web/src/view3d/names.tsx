/** Names of the servos in a 3D picture, each below its servo; a name that would cover a nearer servo is left out. */
import { nameOf, servo } from "../bench/fleet";
import type { Sight } from "../bench/view-link";
import { nameAt, pictured } from "./sight";
import type { Size } from "./wall-projection";

const HIGH = 26;
/** Approximate width of a letter; names are cut at the width of their servo's place. */
const WIDE = 8;
const MOST = 140;

export function Names({
  sight,
  size,
  names,
}: {
  sight: Sight;
  size: Size;
  names?: ReadonlyMap<string, string>;
}) {
  const near = [...sight.servos].sort((a, b) => depth(b.at, sight) - depth(a.at, sight)).reverse();
  const taken: { left: number; right: number; top: number; bottom: number }[] = [];
  const shown = near.flatMap(stand => {
    const said = names?.get(stand.uid) ?? nameOf(servo(stand.uid));
    const at = nameAt(stand, sight, size);
    const top = pictured([stand.at[0], stand.at[1], stand.at[2] + stand.high[2]], sight, size);
    if (!at || !top || said === "") return [];
    const half = Math.min(MOST, said.length * WIDE + 16) / 2;
    const front = stand === near[0];
    const y = front ? Math.min(at.y + 4, size.height - HIGH - 8) : at.y + 4;
    const label = { left: at.x - half, right: at.x + half, top: y, bottom: y + HIGH };
    const body = {
      left: at.x - half,
      right: at.x + half,
      top: top.y - (at.y - top.y) * 0.4,
      bottom: y + HIGH,
    };
    const covers = taken.some(
      one =>
        label.left < one.right && label.right > one.left && label.top < one.bottom && label.bottom > one.top,
    );
    taken.push(body);
    return covers || at.x < 0 || at.x > size.width || y > size.height
      ? []
      : [{ uid: stand.uid, said, x: at.x, y }];
  });
  return (
    <>
      {shown.map(one => (
        <span
          key={one.uid}
          class="chip view-name"
          data-testid={`view-name-${one.uid}`}
          style={{ left: `${one.x.toFixed(1)}px`, top: `${one.y.toFixed(1)}px`, maxWidth: `${MOST}px` }}
        >
          {one.said}
        </span>
      ))}
    </>
  );
}

function depth(at: readonly [number, number, number], { eye, ahead }: Sight): number {
  return (at[0] - eye[0]) * ahead[0] + (at[1] - eye[1]) * ahead[1] + (at[2] - eye[2]) * ahead[2];
}
