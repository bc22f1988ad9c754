/** Owns the Japanese list of keys; loaded with it. */
import type { Topics } from "../language";

export const words = {
  title: "キー操作",
  here: "このページ",
  everywhere: "すべてのページ",
  pages: "ページ移動: gに続けて文字",
  stop: [
    ["Esc", "停止。ダイアログは何もせずに閉じる"],
    ["Space", "停止。入力中とボタン上を除く"],
    ["?", "このキー一覧"],
    ["Tab", "次の操作部品へ。Shiftで前へ"],
  ],
  search: ["/", "このページを検索"],
  select: ["← →", "前後のタブへ（タブにフォーカスがあるとき）"],
  diff: ["Ctrl S", "編集済みの変更を表示。保存はしない"],
  undo: ["Ctrl Z", "最後の編集を取り消す"],
  number: ["↑ ↓", "数値を1単位変える（入力欄にフォーカスがあるとき）。Shiftで×10、Altで÷10"],
  enter: ["Enter", "入力した値を編集に入れる"],
  jog: ["← →", "1°ジョグ（ジョグにフォーカスがあるとき）。Shiftで10°、Altで0.1°"],
  jogZero: ["0", "0°へ（ジョグにフォーカスがあるとき）"],
  jogHold: ["← →", "速度とトルクでは、押している間だけその向きに回る。離すとブレーキ"],
  jogEnter: ["Enter", "入力した角度を送る"],
  monitor: ["↑ ↓", "前後の転送へ（モニターにフォーカスがあるとき）"],
  scrub: ["← →", "記録を1サンプル進める、戻す（時間軸にフォーカスがあるとき）。Shiftで1\u202fs"],
  scrubEnds: ["Home End", "記録の始めと終わりへ（時間軸にフォーカスがあるとき）"],
  scroll: ["↑ ↓", "スクロール（一覧にフォーカスがあるとき）"],
} satisfies Topics["keys"];
