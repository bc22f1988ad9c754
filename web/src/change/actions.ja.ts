/** The Japanese words for what can be done with a servo as a whole; loaded with it. */
import type { Said } from "../text/language";
import type { words as english } from "./actions.en";

export const words = {
  label: name => `${name}の操作`,
  wiggle: "±3°動かす",
  shortly: "動かす",
  wiggleHint: "ホーンが左右に3°ずつ2回動いて戻ります。最大30\u202frpm、トルク30\u202f%、約3\u202fsです。",
  asking: "動作権を要求中",
  moving: at => `${at}を中心に±3.0°動作中`,
  moved: (low, high) => `${low}から${high}まで動き、戻りました。`,
  notWiggled: why => `動かしていません。${why}`,
  more: "その他",
  restart: "再起動…",
  restartLine: "ROMを読み込み直します。RAMのみの値は失われます",
  reset: "初期化…",
  resetLine: "RAMとROMのすべての値を初期値に戻します",
  checking: "確認中",
  underWay: n => (n === 1 ? "このサーボは変更中です。" : "変更中のサーボがあります。"),
  notRestarted: why => `再起動していません。${why}`,
  notReset: why => `初期化していません。${why}`,
  dismiss: "閉じる",
} satisfies Said<typeof english>;
