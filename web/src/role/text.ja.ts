/** The Japanese words of connection roles. */
import type { Translated } from "../text/language";
import type { words as english } from "./text.en";

export const words = {
  name: { host: "ホスト", guest: "ゲスト", observer: "オブザーバ", auto: "自動" },
  means: {
    auto: "まず1.5\u202fs受信します。オートパイロットや別のアロケータがあればゲスト、なければホストになります。",
    host: "サーボを設定し指令する唯一のプログラムです。ノードIDを割り当てます。",
    guest:
      "オートパイロットと併用します。ノードIDは割り当てず、読み出しは200フレーム/sまで、他のノードが指令していないサーボだけを動かします。",
    observer: "フレームを一切送信しません。読み出しも指令も停止も送りません。",
  },
  label: "接続の役割",
  remembered: "役割はこのアダプタについて記憶されます。",
  title: "役割を変えますか？",
  verb: "役割を変える",
  doing: "変更中…",
  change: "役割を変える…",
  torque: "指令中のサーボは先にトルクがオフになります。アダプタを開き直します。",
  guest: reason => `ゲスト${reason === "" ? "" : `: ${reason}`}`,
  guestCommanded: (nodes, n, all) => `ゲスト: サーボ${all}台のうち${n}台を${nodes}が指令しています。`,
  guestLine:
    "hornbillはノードIDを割り当てず、読み出しは200フレーム/sまで、他のノードが指令していないサーボだけを動かします。",
  reaches: names => (names === "" ? "停止が届くサーボは今ありません。" : `停止は${names}に届きます。`),
  notAll: "なぜ全部ではないか",
  reachWhy:
    "オートパイロットが指令しているサーボのトルクをオフにすると舵が失われ、飛行中なら墜落します。そのため停止はhornbillが指令しているサーボだけに届きます。残りも止めるには、停止を押してから、その帯の「すべて停止」を押してください。",
  toAutopilot: "オートパイロット…",
  observer: "オブザーバ: hornbillは何も送信しません。",
  observerLine: "サーボは、他のノードに識別情報を返したときに一覧に現れます。",
  observerStop: "停止を押しても何も送信しません。サーボを止めるには電源を切るか、役割を変えてください。",
  node: id => `ノード${id}`,
  everyone: n => `サーボ${n}台をすべて停止…`,
  everyoneTitle: "オートパイロットが指令しているサーボも停止しますか？",
  everyoneVerb: "すべてのサーボを停止",
  everyoneText:
    "このバスのすべてのサーボのトルクがオフになります。飛行中の機体は舵を失い、墜落します。オートパイロットは指令を送り続けますが、トルクをもう一度オンにするまでサーボは動きません。",
  by: "指令元",
  command: "指令",
  error: "追従誤差",
  you: "hornbill",
  none: "指令なし",
  noCommand: "なし",
  typed: type => `、${type}`,
  since: at => `${at}から`,
  holds: "最後の指令を保持",
  noRate: "指令は1回",
  timeout: {
    off: s => `0x27: ${s}後に出力オフ`,
    hold: () => "0x26: 最後の指令を保持",
    brake: s => `0x27: ${s}後にブレーキ`,
  },
  type: {
    unitless: "ArrayCommand",
    position: "ArrayCommand（位置）",
    force: "ArrayCommand（力）",
    speed: "ArrayCommand（速度）",
    pwm: "ArrayCommand（PWM）",
    unknown: "ArrayCommand（種別不明）",
  },
} satisfies Translated<typeof english>;
