/** Japanese words of the actions on a whole servo; loaded with them. */
import type { Translated } from "../text/language";
import type { words as english } from "./actions.en";

export const words = {
  label: name => `${name}の操作`,
  wiggle: "動作確認 ±3°",
  shortly: "動作確認",
  wiggleHint: "ホーンが左右に3°ずつ2回動いて戻ります。最大30\u202frpm、トルク30\u202f%、約3\u202fsです。",
  requesting: "動作権を要求中",
  moving: at => `${at}を中心に±3.0°で動作確認中`,
  moved: (low, high) => `${low}から${high}まで動き、戻りました。`,
  notWiggled: why => `動作確認できません。${why}`,
  more: "その他",
  restart: "再起動…",
  restartLine: "ROMを読み込み直します。RAMのみの値は失われます",
  reset: "初期化…",
  resetLine: "RAMとROMのすべての値を初期値に戻します",
  checking: "確認中",
  underWay: n => (n === 1 ? "このサーボは変更中です。" : "変更中のサーボがあります。"),
  notRestarted: why => `再起動できません。${why}`,
  notReset: why => `初期化できません。${why}`,
  dismiss: "閉じる",
} satisfies Translated<typeof english>;
