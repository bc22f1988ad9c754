/** The Japanese sentences of what is fetched with the Parameters page: help, confirmation, undo. */
import type { Said } from "../text/language";
import type { words as english } from "./text.en";

const LOAD = "出力がオフのサーボは何も保持せず、負荷が落ちることがあります。";

export const words = {
  favourite: row => `${row}をお気に入りにする`,
  help: {
    open: row => `${row}の説明`,
    register: "レジスター",
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
    keys: "↑ ↓で1単位、Shiftで10、Altで0.1。Enterで確定、Escで入力を戻します（全サーボも停止します）。",
    unitFollows: row => `単位は${row}に従います。`,
    origin: "読み出し",
    readAgo: age => `${age}前`,
  },
  fold: {
    show: n => `上級者向け${n}項目を表示`,
    hide: "折りたたむ",
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
      supply: "電源を確認した: この電圧制限は意図どおり",
      temperature: "温度を確認した: この制限は意図どおり",
      torque_off_in_rom: "ROMのトルクオフは意図どおり: 起動後は何も保持しない",
      torque_on_in_rom: "ROMのトルクオンは意図どおり: 起動のたびにホーンを保持する",
      multi_turn: "±180°を超える角度は意図どおり: 回転数は電源を切ると失われる",
    },
    torqueOff:
      "ROMのトルクモードがオフまたはブレーキになります。起動するたびに、トルクをオンにするまで何も保持しません。",
    torqueUnknown:
      "ROMのトルクモード（0x20）が不明なため、保存時に維持できません。ROMに入れる値を選んでください。",
    choices: {
      torque_on_in_rom: "トルクオン: 起動のたびにホーンを保持する",
      torque_off_in_rom: "トルクオフ: 起動後は何も保持しない",
    },
  },
  lost: {
    line: (n, at) => `${at}: 保存せずに再起動したため、RAMの${n}件の値が失われました。`,
    stage: n => `${n}件の値を再び編集に入れる`,
    staged: "編集に入れました",
  },

  undo: {
    line: (n, at) => `${at}: ${n}件の値をRAMに書き込みました。`,
    open: "元に戻す…",
    dismiss: "閉じる",
  },
} satisfies Said<typeof english>;
