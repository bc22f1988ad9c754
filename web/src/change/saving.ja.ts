/** Japanese words of a save to ROM, and of the bar before it. */
import type { Translated } from "../text/language";
import type { words as english } from "./saving.en";

export const words = {
  changes: (n, name) => `${name}: 変更${n}件`,
  invalid: n => `無効な値 ${n}件`,
  parts: (staged, ram) =>
    [staged > 0 ? `編集済み${staged}件` : "", ram > 0 ? `RAMのみ${ram}件` : ""].filter(Boolean).join("、"),
  torqueIsOne: "（トルクモードを含む）",
  invalidNever: "無効な値は送信しません。",
  discard: "破棄",
  diff: "差分を表示",
  ctrlS: "Ctrl S",
  ctrlEnter: "Ctrl Enter",
  apply: n => `${n}件をRAMに適用`,
  applySub: "再起動なし。電源オフで消えます",
  save: "適用してROMに保存…",
  saveOnly: "ROMに保存…",
  working: { checking: "保存できるか確認中", applying: "RAMに書き込み中", saving: "ROMに保存中" },
  noLink: "接続待ち",
  offline: name => `${name}はオフライン`,
  sub: {
    softStart: name => `${name}は再起動し、ホーンが0.0°へ動きます`,
    hold: name => `${name}は再起動後、その位置を保持します`,
    off: name => `${name}はトルクオフで再起動します`,
    brake: name => `${name}はブレーキで再起動します`,
    unknown: name => `${name}は再起動します`,
  },
  title: (n, name) => (n === 0 ? `${name}をROMに保存しますか？` : `${name}の${n}件の値をROMに保存しますか？`),
  diffTitle: (n, name) => `${name}の変更${n}件`,
  facts: (model, serial, id) => `${model}、${serial}、サーボ${id}`,
  unknownHead: "ホーンが動くことがあります",
  outputOn: "今は出力がオフです。保存の直前に出力をオンにし、再起動までホーンを今の位置で保持します。",
  nothing: "ROMの値はすべて同じです。それでもサーボは保存して再起動します。",
  unknownRows: n => `他の${n}件の値はそのまま保存します。今のROMの値は不明です。`,
  idChange: "サーボIDまたはノードIDが変わります。サーボは固有IDで再び見つかります。",
  head: { parameter: "パラメータ", rom: "今のROM", ram: "RAM", after: "保存後" },
  afterSave: n => (n === 1 ? "保存後にサーボが再起動します" : "保存後に各サーボが再起動します"),
  free: n =>
    n === 1
      ? "ホーンは自由に回り、近くに人はいません"
      : `これら${n}台のホーンは自由に回り、近くに人はいません`,
  confirm: name => `保存して${name}を再起動`,
  notSaved: why => `保存できません: ${why}`,
} satisfies Translated<typeof english>;
