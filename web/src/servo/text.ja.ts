/** Japanese words common to all pages of a servo; loaded with them. */
import type { Translated } from "../text/language";
import type { words as english } from "./text.en";

export const words = {
  head: {
    tabs: "このサーボのページ",
    before: "前のサーボ",
    after: "次のサーボ",
    place: (n, of) => `${n} / ${of}`,
    saved: "ROMに保存済み",
    notKnown: "ROM不明",
    owed: (name, rows) =>
      `${name}に一時的な値が残っています: ${rows}。応答があり次第、元に戻します。それまでは動作できません。`,
  },
  side: {
    angle: "角度",
    command: "指令",
    inactive: "無効",
    speed: "速度",
    torque: "トルク",
    about: "約",
    board: "基板",
    boardTolerance: "±5\u202f°C",
    supply: "電源",
    supplyTolerance: "±0.5\u202fV",
  },
} satisfies Translated<typeof english>;
