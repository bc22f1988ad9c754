/** Japanese words fetched with the Parameters page: help, confirmation, undo. */
import type { Translated } from "../text/language";
import type { words as english } from "./text.en";

const LOAD = "出力がオフのサーボは何も保持せず、負荷が落ちることがあります。";

export const words = {
  favourite: row => `お気に入り: ${row}`,
  help: {
    open: row => `${row}の説明`,
    register: "レジスタ",
    raw: "生値",
    unread: "未読み出し",
    step: "刻み",
    stepOf: step => `${step}ずつ`,
    range: "範囲",
    rangeOf: (low, high) => `${low}～${high}`,
    standard: "初期値",
    section: number => `サーボ仕様書 ${number}節`,
    address: (name, address) => `${name}（番号 ${address}）`,
    afterRestart: "次の再起動後に有効になります。",
    keys: "↑ ↓で1単位、Shiftで10、Altで0.1。Enterで確定、Escで編集を取り消します（全サーボも停止します）。",
    unitFollows: row => `単位は${row}に従います。`,
    origin: "読み出し",
    readAgo: age => `${age}前`,
  },
  fold: {
    show: n => `上級者向け${n}項目を表示`,
    hide: "非表示",
    what: names => `上級者向け: ${names}。`,
  },
  confirm: {
    supply: (row, wanted, reading, margin) =>
      `${row} ${wanted}では出力がすぐにオフになることがあります: 電源は現在${reading}（±${margin}）です。${LOAD}`,
    temperature: (row, wanted, reading, margin) =>
      `${row} ${wanted}では出力がすぐにオフになることがあります: 温度は現在${reading}（±${margin}）です。${LOAD}`,
    unknown: (row, wanted) =>
      `${row} ${wanted}では出力がすぐにオフになることがあります: 比較する値が不明です。${LOAD}`,
    turns: (row, wanted, turns) =>
      `${row} ${wanted}は${turns}回転です。±180°を超える角度は回転数を数えるだけで、電源を切ると失われます。`,
    ticks: {
      supply: "電源を確認しました。この電圧制限は意図どおりです",
      temperature: "温度を確認しました。この制限は意図どおりです",
      torque_off_in_rom: "ROMのトルクオフは意図どおりです。起動後は何も保持しません",
      torque_on_in_rom: "ROMのトルクオンは意図どおりです。起動のたびにホーンを保持します",
      multi_turn: "±180°を超える角度は意図どおりです。回転数は電源を切ると失われます",
    },
    torqueOff:
      "ROMのトルクモードがオフまたはブレーキになります。起動するたびに、トルクをオンにするまで何も保持しません。",
    torqueUnknown:
      "ROMのトルクモード（0x20）が不明なため、保存時に維持できません。ROMに入れる値を選んでください。",
    choices: {
      torque_on_in_rom: "トルクオン: 起動のたびにホーンを保持します",
      torque_off_in_rom: "トルクオフ: 起動後は何も保持しません",
    },
  },
  lost: {
    line: (n, at) => `${at}: 保存せずに再起動したため、RAMの${n}件の値が失われました。`,
    stage: n => `${n}件の値を再び変更に追加`,
    staged: "変更に追加しました",
  },

  undo: {
    line: (n, at) => `${at}: ${n}件の値をRAMに書き込みました。`,
    open: "取り消し…",
    dismiss: "閉じる",
  },
} satisfies Translated<typeof english>;
