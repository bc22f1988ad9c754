/** Japanese words of the dialog that restores outputs; loaded with it. */
import type { Topics } from "../text/language";

export const words = {
  title: n => `${n}台の出力を復帰しますか？`,
  lead: "1台ずつ順に出力をオンにします。各ホーンは今の位置で保持されます。",
  clears: "停止を解除します。",
  load: "負荷あり",
  loaded: names => `負荷あり: ${names}。出力がオンになると、ホーンに負荷がかかります。`,
  torque: pct => `トルク約${pct}`,
  stays: why => `復帰しません。${why}`,
  keeps:
    "サーボの指令タイムアウト（0x26）で出力が再びオフになるため、このページが動作権を取得します。このページを離れる、タブを隠す、または動作を終了すると、出力はオフになります。",
  again: "停止がもう一度押されました。閉じて確認してから出力を復帰してください。",
  go: "出力を復帰",
  refused: why => `出力を復帰できません。${why}`,
  running: "出力を復帰中",
  done: n => `${n}台の出力がオンになりました`,
  failed: (on, all) => `${all}台中${on}台の出力がオンになりました`,
  cleared: "停止を解除",
  held: deg => `${deg}で保持`,
  steps: "手順",
  stop: "停止で直ちに終了します。",
} satisfies Topics["restoring"];
