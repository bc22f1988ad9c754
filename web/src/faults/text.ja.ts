/** Japanese text of the Faults page; loaded with it. */
import type { Translated } from "../text/language";
import type { words as english } from "./text.en";

export const words = {
  title: "異常",
  summary: (now, unseen) =>
    now === 0 && unseen === 0 ? "現在、異常はありません" : `発生中${now}件、未確認${unseen}件`,
  servo: "サーボ",
  all: "すべてのサーボ",
  ackAll: "すべて確認",
  ack: "確認",
  ackOf: (label, name) => `確認: ${name}の${label}`,
  now: "発生中",
  past: "過去",
  noneNow: "これらのサーボに発生中の異常はありません。",
  nonePast: "過去の異常はありません。",
  level: { failure: "障害", warning: "警告", notification: "通知" },
  latched: "電源を切るまで残る",
  latchedWhy: "原因がなくなっても自動では消えません。再起動で消えます。",
  pastEvent: "直前の起動より前",
  pastEventWhy: "現在の状態ではなく、サーボの起動前に起きたことを示します。",
  stale: "現在の状態は不明",
  staleWhy: "サーボが最後に報告した状態です。応答がないため、現在の状態は不明です。",
  over: "解消",
  first: "初回",
  last: "最終検出",
  count: n => `${n}回`,
  seenBy: (who, at) => `${who}が確認、${at}`,
  emptyTitle: "異常はまだありません",
  emptyText:
    "サーボは障害、警告、通知を32種類ずつ報告でき、hornbillはそれを常に読み出します。発生した異常は、意味と対処とともにここに表示されます。解消した後も過去の一覧に残ります。",
  emptyLive: (servos, read) => `既知のサーボ${servos}台、読み出し済み${read}台。`,
  toServos: "サーボへ",
  acknowledgeText:
    "確認すると、異常が確認済みとして記録されます。サーボの異常は消えません。異常は、原因がなくなるか再起動すると消えます。",
  loading: "異常を読み込み中",
  failed: why => `異常の一部を読み出しまたは確認できません。${why}`,
  open: name => `${name}を開く`,
} satisfies Translated<typeof english>;
