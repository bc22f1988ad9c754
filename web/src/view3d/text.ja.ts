/** Japanese text of the 3D view and the wall of horns; loaded with them. */
import type { Translated } from "../text/language";
import type { words as english } from "./text.en";

export const words = {
  frame: "3D表示",
  live: age => `ライブ、${age}`,
  frozen: age => `更新停止。最終データは${age}前`,
  noData: "更新停止。データ未受信",
  limits: (low, high) => `制限 ${low}～${high}`,
  none: "3D表示は利用できません",
  loading: "3D表示を開いています",
  qualities: { auto: "画質: 自動", high: "画質: 高", low: "画質: 低" },
  qualityAuto: { high: "画質: 自動、高", low: "画質: 自動、低" },
  qualityHint: "「高」では反射と影を描きます。「低」はGPUのないコンピュータ向けです。",
  reset: "視点を戻す",
  all: "すべて表示",
  allHint: "このサーボの後ろに、ほかのサーボも表示します。",
  grip: {
    horn: "ドラッグしてホーンを動かす",
    ccw: "ドラッグしてCCW角度制限を編集",
    cw: "ドラッグしてCW角度制限を編集",
    off: "動作は無効です。動作ページで動作を有効にしてから、ホーンをドラッグしてください。",
    notNow:
      "ホーンをドラッグできるのは、トルクがオン、「角度」を選択中、ドラッグのロックを解除済みのときだけです。",
    noDraft: "角度制限は現在変更できません。",
    staged: (low, high) => `編集済み、未送信: ${low}～${high}`,
  },
  replay: {
    frame: "記録の3D表示",
    band: "記録を表示中（ライブではありません）",
    noValue: "この時刻には角度の記録がまだありません",
    angles: (angle, command) => `${angle}、指令 ${command}`,
    old: "この時刻のデータなし: 最後の値を表示",
    noModel: "機種の記録なし: BLA21として表示",
  },
  wall: count => `ホーン${count}個`,
  wallOpen: (name, angle, state) => `${name}、${angle}、${state}`,
  wallEmpty: "サーボはまだありません。バスに接続されたサーボがホーンとともに表示されます。",
  wallOld: (angle, age) => `${angle}、${age}前`,
  wallLost: "更新停止。hornbillに未接続",
} satisfies Translated<typeof english>;
