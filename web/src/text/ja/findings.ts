/** Owns the Japanese titles and remedies of the doctor's findings. */
import type { Topics } from "../language";

const ENDS = "両端に120\u202fΩ";
const WIRES = `電源、次にCAN_H、CAN_L、グランド、次に終端（${ENDS}）を確認してください。`;
const SILENT =
  "送信はしていますが受信していないか、サーボではありません: ケーブルを確認し、その後電源を切って再起動してください。";

export const words = {
  well: {
    adapter: "アダプターまたは記録の再生は正常",
    bus_off: "バスに参加中",
    bit_rate: "ビットタイミング",
    no_traffic: "フレームを受信中",
    own_node_id: "hornbillのノードIDの重複なし",
    duplicate_node_id: "ノードIDの重複なし",
    duplicate_servo_id: "サーボIDの重複なし",
    second_allocator: "割り当て器は1つ",
    allocation_stuck: "ノードIDを待ち続けるノードなし",
    frames_dropped: "フレームの取りこぼしなし",
    errors_rising: "エラーなし、またはわずか",
    load_over_budget: "バス負荷は上限以内",
    silent_node: "要求に応答しないノードなし",
    answers_lost: "応答を受信中",
    answers_slow: "サーボの応答は時間内",
    servo_offline: "検出後に途絶えたサーボなし",
    foreign_frames: "DroneCANフレームのみ",
  },
  wrong: {
    no_bus: "バスに未接続",
    adapter_failed: "アダプターを開けない",
    adapter_lost: "アダプター喪失",
    interface_down: "CANインターフェースが停止中",
    bus_off: "hornbillのコントローラーがバスオフ",
    bus_was_off: "hornbillのコントローラーがバスオフだった",
    bit_rate: "アダプターのビットレートの不一致",
    sample_point: "サンプルポイントの不一致（サーボは87.5\u202f%）",
    only_errors: "バス上はエラーフレームのみ",
    unacknowledged: "バス上はhornbillのみ",
    no_traffic: "バスからの受信なし",
    errors_rising: "エラーの増加、またはエラーパッシブ",
    load_over_budget: "バス負荷の上限超過",
    frames_dropped: "hornbillに届くまでのフレームの取りこぼし",
    foreign_frames: "DroneCAN以外のフレームあり",
    own_node_id: "hornbillのノードID {node}を使う別のノード",
    duplicate_node_id: "ノードID {node}を使う2台のノード",
    duplicate_servo_id: "同じサーボIDを使う{count}台のサーボ",
    second_allocator: "ノード{node}もノードIDを割り当て",
    allocator_off: "ノードID待ちのノードあり、割り当て器はオフ",
    allocation_refused: "ノードIDを割り当てられないノード",
    allocation_stuck: "ノードID待ちのまま進まないノード",
    node_id_not_taken: "与えられたノードID {node}を使わないノード",
    silent_node: "ノード{node}の応答なし",
    silent_servo: "{servo}（ノード{node}）の応答なし",
    answers_lost: "応答の欠落",
    answers_slow: "応答の遅れ",
    servo_offline: "{servo}の通信途絶",
  },
  remedy: {
    bus_was_off: "CAN_HとCAN_Lの短絡と、別のビットレートのノードを探してください。",
    only_errors: `すべてのノードとアダプターを、サーボのビットレートである1\u202fMbit/sにしてください。そうなっている場合は、CAN_HとCAN_Lの入れ違いまたは短絡、グランドの欠落、終端（${ENDS}）を調べてください。`,
    unacknowledged: WIRES,
    no_traffic: WIRES,
    errors_rising: `コネクターとケーブル、終端（${ENDS}）、スタブの長さを確認してください。`,
    load_over_budget: "何がそれほど多く送っているかをモニターで確認し、遅くするか、バスから外してください。",
    frames_dropped:
      "このコンピューターに負荷をかけている他のものを閉じるか、バッファーの大きいアダプターを使ってください。",
    foreign_frames:
      "負荷になるほかに害はありません。CAN FDフレームは、クラシックCANだけを扱うサーボを混乱させます。",
    duplicate_node_id:
      "一方をバスから外し、もう一方のノードID（パラメーター0x46）を0にして保存し、外した方を戻してください。",
    duplicate_servo_id: "1台を除くすべてに別のサーボID（パラメーター0x45）を付け、保存してください。",
    allocation_stuck: `ノードがhornbillの応答を受信していないか、ノードからの送信が失われています: 配線と終端（${ENDS}）を確認し、その後ノードを再起動してください。`,
    node_id_not_taken: `ノードがhornbillの最後の応答を受信していません: 配線と終端（${ENDS}）を確認してください。`,
    silent_node: SILENT,
    silent_servo: SILENT,
    answers_lost: `最初に挙がったノードのコネクターとケーブルを確認し、次に終端（${ENDS}）を確認してください。`,
    answers_slow:
      "アダプターまたはこのコンピューターが混み合っていないか、バスに負荷がかかっていないかを確認してください。",
    servo_offline: "電源を確認し、次にケーブルを確認してください。",
  },
} satisfies Topics["findings"];
