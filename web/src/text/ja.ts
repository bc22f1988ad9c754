/** Owns the catalogue of everything the page says, in Japanese. */

import { cautions } from "./ja/cautions";
import { happened, marks, refusals } from "./ja/events";
import { frame } from "./ja/frame";
import { live } from "./ja/live";
import { parameters } from "./ja/parameters";
import { servos } from "./ja/servos";
import { table } from "./ja/table";
import { readable, type Text } from "./language";

export const text = {
  name: "hornbill",
  on: "オン",
  off: "オフ",
  cancel: "キャンセル",
  close: "閉じる",
  comma: "、",
  guides: {
    contents: "ドキュメント（英語）",
    tutorial: "最初のサーボを10分で（英語）",
    adapters: "アダプターの接続方法（英語）",
    commission: "新しいサーボの設定方法（英語）",
    bus: "バスの不具合の調べ方（英語）",
    recover: "見失ったサーボの復旧方法（英語）",
    faults: "異常と測定値の意味（英語）",
    profiles: "プロファイル、複製、履歴の使い方（英語）",
    record: "記録、書き出し、測定の方法（英語）",
    rigs: "試験装置: Python、pytest、LabVIEWなど（英語）",
    move: "プログラムからサーボを動かす方法（英語）",
    socket: "WebSocket（英語）",
  },
  docs: "文書",
  docsLabel: "文書（英語）を新しいタブで開く",
  values: n => `${n}件の値`,

  ...frame,
  ...servos,
  ...parameters,
  ...live,

  table,
  cautions,
  happened,
  marks,
  refusals,

  problem(problem) {
    const facts = problem.facts;
    switch (problem.code) {
      case "lease_held":
        return live.motion.heldBy(
          readable(String(facts.holder ?? "他の人"), live.motion.holder),
          facts.expires_in_s,
        );
      case "stopped":
        return live.motion.whileStopped;
      case "bus_disconnected":
        return "バスに接続していません。アダプターを接続してください。";
      case "bus_read_only":
        return "このバスは記録の再生です。何も書き込みません。実際のバスを接続してください。";
      case "unknown_servo":
        return "このサーボはもう登録されていません。";
      case "stale_revision":
        return "他の人がこのサーボを変更しました。現在の値を確認してから、やり直してください。";
      case "lease_required":
        return "先に動作権を取ってください。";
      case "configuration_lost":
        return "サーボは保存値を失い、初期値で動いています。記録からスナップショットを復元するか、現在の値を保存してください。";
      case "no_link":
        return "hornbillが応答しません。";
      case "unauthorized":
        return "トークンが必要です。このページでサインインしてください。";
      default:
        return problem.message;
    }
  },
} satisfies Text;
