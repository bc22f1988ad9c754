/** The Japanese sentences of the Faults page; loaded with it. */
import type { Said } from "../text/language";
import type { words as english } from "./text.en";

export const words = {
  title: "異常",
  summary: (now, unseen) =>
    now === 0 && unseen === 0 ? "現在、異常はありません" : `発生中${now}件、未確認${unseen}件`,
  servo: "サーボ",
  all: "すべてのサーボ",
  ackAll: "すべて確認済みにする",
  ack: "確認",
  ackOf: (label, name) => `確認: ${name}の${label}`,
  now: "発生中",
  past: "過去",
  noneNow: "これらのサーボに異常はありません。",
  nonePast: "他に異常はありませんでした。",
  level: { failure: "故障", warning: "警告", notification: "通知" },
  latched: "電源を切るまで残る",
  latchedWhy: "原因がなくなっても自動では消えません。再起動で消えます。",
  pastEvent: "前回の起動より前",
  pastEventWhy: "今の状態ではなく、サーボの起動前に起きたことを示します。",
  stale: "現在は不明",
  staleWhy: "サーボの最後の報告です。今は応答がないため、続いているか不明です。",
  over: "終了",
  first: "初回",
  last: "最終",
  count: n => `${n}回`,
  seenBy: (who, at) => `${who}が確認、${at}`,
  emptyTitle: "異常の記録はありません",
  emptyText:
    "サーボは故障、警告、通知を32種類ずつ報告します。hornbillは常に読み出し、発生した異常を意味と対処とともにここに示します。消えた後も過去の一覧に残ります。",
  emptyLive: (servos, read) => `サーボ${servos}台、読み出し済み${read}台。`,
  toServos: "サーボを表示",
  acknowledgeText:
    "確認は、誰かが見たことの記録です。サーボの異常は消えません。原因がなくなるか再起動すると消えます。",
  loading: "異常を読み出し中。",
  failed: why => `異常の一部を読み出しまたは確認できません。${why}`,
  again: "再試行",
  open: name => `${name}を開く`,
} satisfies Said<typeof english>;
