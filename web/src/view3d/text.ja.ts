/** The Japanese sentences of the 3D view, and the wall of horns; loaded with them. */
import type { Said } from "../text/language";
import type { words as english } from "./text.en";

export const words = {
  frame: "3D表示",
  live: age => `ライブ、${age}`,
  frozen: age => `静止。最終データは${age}前`,
  noData: "静止。データ未受信",
  limits: (low, high) => `制限 ${low}～${high}`,
  none: "3D表示は利用できません",
  loading: "3D表示を開いています",
  qualities: { auto: "画質: 自動", high: "画質: 高", low: "画質: 低" },
  qualityAuto: { high: "画質: 自動、高", low: "画質: 自動、低" },
  qualityHint: "高では反射と影を描きます。低はソフトウェアで描画するコンピューター向けです。",
  reset: "視点を戻す",
  all: "すべて表示",
  allHint: "このサーボの後ろに、ほかのサーボも表示します。",
  grip: {
    horn: "ドラッグしてホーンを動かす",
    ccw: "ドラッグしてCCW角度制限を編集",
    cw: "ドラッグしてCW角度制限を編集",
    off: "動きません: 動作は無効です。動作ページで動作を有効にしてから、ホーンをドラッグしてください。",
    notNow:
      "動きません: ホーンのドラッグは、トルクがオン、「角度」を選択、ドラッグのロック解除のときにできます。",
    noDraft: "角度制限は今は変更できません。",
    staged: (low, high) => `編集済み、未送信: ${low}～${high}`,
  },
  replay: {
    frame: "記録の3D表示",
    band: "記録の表示中: ライブではありません",
    noValue: "この時刻の角度はまだありません",
    angles: (angle, command) => `${angle}、指令 ${command}`,
    old: "この間は受信なし: 最後の値を表示",
    noModel: "機種は記録になし: BLA21として表示",
  },
  wall: count => `ホーン${count}個`,
  wallOpen: (name, angle, state) => `${name}、${angle}、${state}`,
  wallEmpty: "サーボはまだありません。接続すると、各サーボがホーンとともに現れます。",
  wallOld: (angle, age) => `${angle}、${age}前`,
  wallLost: "静止。hornbillに未接続",
} satisfies Said<typeof english>;
