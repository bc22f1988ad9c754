/** Japanese catalogue of words needed by every page. */

import { frame } from "../frame/text.ja";
import { live } from "../motion/text.ja";
import { parameters } from "../parameters/text.ja";
import { servos } from "../servos/text.ja";
import { table } from "./ja/table";
import type { Text } from "./language";

export const text = {
  name: "hornbill",
  on: "オン",
  off: "オフ",
  cancel: "キャンセル",
  close: "閉じる",
  comma: "、",
  period: "。",
  guides: {
    contents: "ドキュメント（英語）",
    tutorial: "最初のサーボを10分で（英語）",
    adapters: "アダプタの接続方法（英語）",
    commission: "新しいサーボの設定方法（英語）",
    bus: "バスの不具合の調べ方（英語）",
    recover: "見失ったサーボの復旧方法（英語）",
    faults: "異常と測定値の意味（英語）",
    tuning: "調整: 判定、グラフ、改善（英語）",
    profiles: "プロファイル、複製、履歴の使い方（英語）",
    record: "記録、書き出し、測定の方法（英語）",
    rigs: "試験装置: Python、pytest、LabVIEWなど（英語）",
    move: "プログラムからサーボを動かす方法（英語）",
    socket: "WebSocket（英語）",
    reference: "すべての操作（英語）",
  },
  docs: "文書",
  docsLabel: "文書（英語）を新しいタブで開く",
  at: (day, time) => `${day} ${time}`,
  unread: why => `読み込めません。${why}`,
  values: n => `${n}件の値`,

  ...frame,
  ...servos,
  ...parameters,
  ...live,

  table,
  /** The server's message, until `ja/codes.ts` is loaded. */
  problem: problem => problem.message,
} satisfies Text;
