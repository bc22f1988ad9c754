/** The Japanese words of export to an autopilot, live verification and failsafe. */
import type { Translated } from "../text/language";
import type { words as english } from "./text.en";

const list = (outputs: readonly number[]) => (outputs.length === 0 ? "" : `出力${outputs.join("、")}: `);

export const words = {
  title: "オートパイロット",
  program: "プログラム",
  programs: { ardupilot: "ArduPilot", px4: "PX4" },
  rate: "レート",
  outputs: "出力",
  against: (source, bus) => `${source}と${bus}の比較`,
  thisPlan: "この計画",
  line: "どの出力がどのサーボをどこまで動かすかを定めます。端と中立はサーボの角度です。",
  head: {
    output: "出力",
    servo: "サーボ",
    low: "CCW端",
    neutral: "中立",
    high: "CW端",
    reversed: "反転",
    function: "機能",
    remove: "削除",
  },
  functionHint: "変更なし",
  id: id => `サーボID ${id}`,
  noServo: "このIDのサーボはありません",
  field: (what, output) => `${what}、出力${output}`,
  remove: output => `出力${output}を削除`,
  propose: "もう一度提案",
  import: "インポート…",
  export: "エクスポート",
  verify: "ライブ検証",
  incomplete: outputs => `${list(outputs)}端、中立、機能を数値で入力すると続けられます。`,
  noOutputs: "このオートパイロットが指令できるIDのサーボがありません。",
  noOutputsLine: (first, last) =>
    `各サーボのサーボID（0x45）を導入ページで${first}～${last}にするか、ファイルをインポートしてください。`,
  loading: "サーボを読み出し中…",
  exported: name =>
    `${name}をダウンロードしました。オートパイロットに読み込んで再起動し、その後ライブ検証してください。`,
  imported: (name, n) => `${name}: 出力${n}本をインポートしました。`,
  advice: "初飛行前に確認すること",
  advices: {
    servo_id_zero: o =>
      `${list(o)}サーボID 0は新品のサーボすべてのIDなので、全台が従います。他の新品のサーボを接続しないでください。`,
    status_not_received: o =>
      `${list(o)}PX4がStatusを受信するのはサーボID 0～8だけで、このサーボは記録されません。`,
    throw_beyond_limits: o =>
      `${list(o)}端がサーボの角度リミット（0x38、0x39）を超えており、サーボはリミットで止まります。舵角を小さくしてください。`,
    step_above_deadband: o =>
      `${list(o)}オートパイロットの1ステップは0.36°で、サーボの不感帯より大きい値です。`,
    silent_when_unarmed: o =>
      `${list(o)}安全スイッチがオンの間、ArduPilotは指令を送らず、出力はオフまたはブレーキになります（0x26、0x27）。`,
    node_id_dynamic_range: o =>
      `${list(o)}ノードIDが固定で、オートパイロットが割り当てる範囲内です。0x46を0にしてください。`,
    position_in_log: _o =>
      "オートパイロットのログでは、position × 100が角度（°）です。サーボは100°を1.0と報告します。",
  },
  verifyHead: {
    output: "出力",
    servo: "サーボ",
    exported: "エクスポート値",
    bus: "バス上の値",
    seen: (low, high) => `観測、${low}～${high}`,
    result: "結果",
    cause: "原因",
    measure: "測定",
  },
  counts: (match, failed, warned, left) =>
    [
      `一致${match}`,
      failed > 0 ? `不合格${failed}` : "",
      warned > 0 ? `警告${warned}` : "",
      left > 0 ? `未測定${left}` : "",
    ]
      .filter(Boolean)
      .join("、"),
  step: (n, of) => `ステップ${n}/${of}:`,
  again: "もう一度:",
  neutral: "すべての操作を中立にする",
  positive: (output, label) =>
    label === "" ? `出力${output}の操作を正方向いっぱいに保つ` : `${label}の操作を正方向いっぱいに保つ`,
  left: (passed, all) => `${passed} / ${all}`,
  measure: "測定",
  measureOne: output => `出力${output}を測定`,
  done: "すべての出力を測定しました。",
  silent: "バス上にArrayCommandがありません。オートパイロットをアームし、安全スイッチを解除してください。",
  cancel: "キャンセル",
  close: "閉じる",
  noEntry: "指令なし",
  result: {
    matches: "一致",
    reversed: "反転",
    swapped: other => `出力${other}と入れ替わり`,
    missing: "なし",
    throw_too_small: "舵角が小さい",
    throw_too_large: "舵角が大きい",
    wrong_type: "指令の種別が違う",
    not_moved: "まだ十分に動いていない",
  },
  of: (output, what) => `出力${output}: ${what}`,
  within: deg => `エクスポートした端との差は${deg}以内です。`,
  neutralWithin: "中立はエクスポートどおりです。操作を正方向いっぱいに保ってください。",
  acts: (name, seen, exported) => `${name}は${seen}として働いています。エクスポート値は${exported}です。`,
  set: (name, value) => `${name}をエクスポートどおり${value}にしてください。`,
  assign: name => `${name}を設定してください。出力に機能がありません。`,
  swapped: (output, other) =>
    `出力${output}の操作で出力${other}が動きました。両出力の機能かサーボID（0x45）を入れ替えてください。`,
  wrongType: {
    ardupilot: "UNITLESSで送られていません。CAN_D1_UC_OPTIONのビット4（PWM）をクリアしてください。",
    px4: "UNITLESSで送られていません。",
  },
  notMoved: "測定中、操作を正方向いっぱいに保ってください。",
  unknown: "まだ不明",
  unknownLine: "0x26と0x27は未読です。",
  action: {
    hold: "最後の指令を保持",
    off: s => `${s}後に出力オフ`,
    brake: s => `${s}後にブレーキ`,
  },
  actionLine: {
    hold: "指令が途絶えても、ホーンはトルクを保ち続けます。",
    off: "指令が途絶えると、ホーンは自由に動かせるようになります。",
    brake: "指令が途絶えると、ホーンは弱く抵抗します。",
  },
  noGap: "未確認: 0x27より長い指令の途絶は観測されていません。",
  gap: (node, s, at) => `ノード${node}が${at}に${s}途絶えました。`,
  gapNow: (node, at) => `ノード${node}が${at}から途絶えています。`,
  torque: pct => `そのときのトルクは${pct}でした。`,
  confirmed: "測定した途絶で確認済み",
} satisfies Translated<typeof english>;
