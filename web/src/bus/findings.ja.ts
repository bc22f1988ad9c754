/** Japanese titles, evidence and remedies of the doctor's findings. tests/contract holds them complete. */
import type { Facts } from "../bench/facts";
import { refusals } from "../text/ja/events";
import type { Said } from "../text/language";
import type { words as english } from "./findings.en";
import { words as bus } from "./text.ja";

const { notes } = bus.line;

const ENDS = "両端に120\u202fΩ";
const WIRES = `電源、次にCAN_H、CAN_L、グランド、次に終端（${ENDS}）を確認してください。`;
/** State of a CAN controller. */
const CONTROLLER: Readonly<Record<string, string>> = {
  active: "アクティブ",
  passive: "エラーパッシブ",
  bus_off: "バスオフ",
};

const controller = (p: Facts) => `コントローラーは${CONTROLLER[p.controller ?? ""] ?? "不明"}`;

/** Those of the parts that are known, in one line. */
const line = (...parts: (string | undefined | false)[]) => parts.filter(Boolean).join("、");

const asking = (p: Facts) => `${p.uid}が${p.over_s}に${p.times}回要求`;

/** Of an adapter that cannot be used: since when, else what it says. */
const lost = (p: Facts) =>
  p.down_s === undefined
    ? (p.problem ?? "")
    : line(
        `${p.down_s}前から`,
        `それまでに自動で開き直した回数${p.reopened}`,
        p.retry_in_s && `${p.retry_in_s}後に再試行`,
      );

const ownId = (p: Facts) =>
  line(
    `ノード${p.node}からhornbillのものでないフレーム${p.frames}件`,
    `他のノードへの要求${p.requests}件`,
    p.gives_ids && "ノードIDも割り当て",
    p.ours_gives_ids ? "hornbillもノードIDを割り当てています" : "hornbillはノードIDを割り当てていません",
  );

export const words = {
  well: {
    adapter: () => "アダプターまたは記録の再生は正常",
    bus_off: () => "バスに参加中",
    bit_rate: () => "ビットタイミング",
    no_traffic: () => "フレームを受信中",
    own_node_id: () => "hornbillのノードIDの重複なし",
    servos_without_id: () => "サーボID 0を共有するサーボなし",
    other_commands: () => "他からの指令なし",
    duplicate_node_id: () => "ノードIDの重複なし",
    duplicate_servo_id: () => "サーボIDの重複なし",
    second_allocator: () => "割り当て器は1つ",
    allocation_stuck: () => "ノードIDを待ち続けるノードなし",
    frames_dropped: () => "フレームの取りこぼしなし",
    errors_rising: () => "エラーなし、またはわずか",
    load_over_budget: () => "バス負荷は上限以内",
    silent_node: () => "要求に応答しないノードなし",
    answers_lost: () => "応答を受信中",
    answers_slow: () => "サーボの応答は時間内",
    serial_line_full: () => "シリアル回線に余裕あり",
    servo_offline: () => "検出後に途絶えたサーボなし",
    foreign_frames: () => "DroneCANフレームのみ",
  },
  wrong: {
    no_bus: () => "バスに未接続",
    adapter_failed: () => "アダプターを開けない",
    adapter_lost: () => "アダプター喪失",
    interface_down: () => "CANインターフェースが停止中",
    bus_off: p =>
      p.ago_s === undefined
        ? "hornbillのコントローラーがバスオフ"
        : "hornbillのコントローラーがバスオフだった",
    bit_rate: () => "アダプターのビットレートの不一致",
    sample_point: p => `サンプルポイントが${p.sample_point_pct}（サーボは${p.wanted_sample_point_pct}）`,
    only_errors: () => "バス上はエラーフレームのみ",
    unacknowledged: () => "バス上はhornbillのみ",
    no_traffic: () => "バスからの受信なし",
    nothing_received: () => "シリアルアダプターからの受信が一度もなし",
    serial_line_full: () => "シリアル回線が満杯: アダプターがフレームを失う可能性あり",
    adapter_silent: () => "アダプターがコマンドに応答しない",
    bit_rate_fixed: () => "アダプターのCANビットレートは固定",
    baud_unknown: () => "アダプターのボーレートが不明",
    adapter_echoes: () => "アダプターが送信内容を返している",
    line_noise: () => "シリアル回線のノイズ",
    latency_timer: () => "FTDIチップのレイテンシタイマーが長い",
    errors_rising: p => (p.rising ? "エラーの増加" : "エラーが多く、コントローラーがエラーパッシブ"),
    load_over_budget: () => "バス負荷の上限超過",
    frames_dropped: () => "hornbillに届くまでのフレームの取りこぼし",
    foreign_frames: () => "DroneCAN以外のフレームあり",
    own_node_id: p => `hornbillのノードID ${p.node}を使う別のノード`,
    makers_program: p => `Futabaの設定ソフトがhornbillのノードID ${p.node}を使用中`,
    servos_without_id: p => `サーボID 0のサーボ${p.count}台は、ID 0への指令で同時に動作`,
    other_commands: p => `ノード${p.node}がサーボに指令を送信中`,
    duplicate_node_id: p => `ノードID ${p.node}を使う2台のノード`,
    duplicate_servo_id: p => `同じサーボIDを使う${p.count}台のサーボ`,
    second_allocator: p => `ノード${p.node}もノードIDを割り当て`,
    allocator_off: () => "ノードID待ちのノードあり、割り当て器はオフ",
    allocation_refused: () => "ノードIDを割り当てられないノード",
    allocation_stuck: p =>
      p.node === undefined
        ? "ノードID待ちのまま進まないノード"
        : `与えられたノードID ${p.node}を使わないノード`,
    silent_node: p =>
      p.servo === undefined ? `ノード${p.node}の応答なし` : `${p.servo}（ノード${p.node}）の応答なし`,
    answers_lost: () => "応答の欠落",
    answers_slow: () => "応答の遅れ",
    servo_offline: p => `${p.servo}の通信途絶`,
  },
  evidence: {
    well: {
      adapter: p => line(p.address, `自動で開き直した回数${p.reopened}`),
      bus_off: p => `接続後のバスオフ${p.times}回`,
      bit_rate: p =>
        line(
          `${Number(p.bitrate) / 1e6}\u202fMbit/s`,
          p.sample_point_pct,
          p.sample_point_pct && `${p.address}から読み返し`,
        ),
      no_traffic: p => `毎秒${p.frames_per_s}フレーム、最後は${p.silence_s}前`,
      own_node_id: p => `他からのフレーム${p.frames}件`,
      duplicate_node_id: p => `バス上のノード${p.nodes}台`,
      duplicate_servo_id: p => `サーボ${p.servos}台、うちIDなし${p.new}台`,
      servos_without_id: p => `IDのないサーボ${p.servos}台`,
      other_commands: () => "最近、他からのArrayCommandはありません。",
      second_allocator: p =>
        p.own !== undefined
          ? `hornbill（ノード${p.own}）のみ。${p.over_s}間、他にありません。`
          : p.answers === undefined
            ? `ノード${p.node}が割り当てていましたが、いなくなりました。`
            : `ノード${p.node}が${p.answers}回応答、最後は${p.ago_s}前。hornbill側はオフです。`,
      allocation_stuck: p => `今要求しているノード${p.requests}台`,
      frames_dropped: p => `${p.over_s}に${p.frames}フレーム中0`,
      errors_rising: p => `${p.over_s}にエラー${p.errors}件`,
      load_over_budget: p =>
        `${p.over_s}で${p.load_pct}（上限${p.limit_pct}）、うちhornbillの要求が約${p.ours_pct}`,
      serial_line_full: p =>
        `${p.over_s}で${p.baud} baudの${p.load_pct}、回線は毎秒${p.frames_per_s}フレームまで`,
      silent_node: p => `バス上のノード${p.nodes}台`,
      answers_lost: p => `${p.over_s}の要求${p.requests}件中${p.lost}件に応答なし`,
      answers_slow: p =>
        `中央値${p.median_ms}、最大${p.slowest_ms}（ノード${p.node}）、${p.over_s}に応答${p.answers}件`,
      servo_offline: p => `接続後のサーボ${p.servos}台`,
      foreign_frames: p => `${p.over_s}に0件`,
    },
    wrong: {
      no_bus: () => "hornbillはアダプターなしで動作しています。",
      adapter_lost: lost,
      adapter_failed: lost,
      interface_down: lost,
      bus_off: p =>
        p.ago_s === undefined
          ? `接続後${p.times}回。最後のフレームは${p.silence_s}前、以後のエラー${p.errors}件`
          : `接続後${p.times}回、最後は${p.ago_s}前`,
      bit_rate: p =>
        p.frames === undefined
          ? lost(p)
          : `アダプターは${Number(p.bitrate) / 1e6}\u202fMbit/s、サーボは1\u202fMbit/s。${p.seconds_s}に受信${p.frames}フレーム`,
      sample_point: p => `${p.address}から読み返した値です。長いケーブルではフレームが失われます。`,
      only_errors: p =>
        `${p.silence_s}にエラーフレーム${p.errors}件、フレーム0件（${Number(p.bitrate) / 1e6}\u202fMbit/s）。${controller(p)}`,
      unacknowledged: p =>
        `応答（ACK）のない送信${p.transmissions}件、${p.silence_s}に受信0フレーム。${controller(p)}`,
      no_traffic: p => `${p.silence_s}に0フレーム、エラー${p.errors}件`,
      nothing_received: p =>
        line(
          `${p.silence_s}に0フレーム、エラー${p.errors}件`,
          p.baud ? `シリアル回線${p.baud} baud` : "シリアル回線はUSB",
        ),
      errors_rising: p =>
        `${p.over_s}にエラー${p.errors}件（${p.seconds}秒分）: バス上${p.on_wire}件、送信できなかったフレーム${p.not_sent}件。${controller(p)}`,
      load_over_budget: p =>
        `${p.over_s}で${p.load_pct}（上限${p.limit_pct}）、うちhornbillの要求が約${p.ours_pct}`,
      serial_line_full: p =>
        `${p.over_s}で${p.baud} baudの${p.load_pct}、回線は毎秒${p.frames_per_s}フレームまで`,
      frames_dropped: p => `${p.over_s}に${p.dropped}フレーム、受信の${p.dropped_pct}`,
      adapter_silent: notes.adapter_silent,
      bit_rate_fixed: notes.bit_rate_fixed,
      baud_unknown: p => notes.baud_unknown({ baud: p.baud ?? "" }),
      adapter_echoes: notes.adapter_echoes,
      line_noise: p => notes.line_noise({ bytes: p.bytes ?? "" }),
      latency_timer: p =>
        `FTDIチップのレイテンシタイマーが${p.latency_ms}です。1\u202fmsに設定すると応答が速くなります。`,
      foreign_frames: p => `${p.over_s}に標準、リモート、CAN FDのフレーム${p.frames}件（無視）`,
      own_node_id: ownId,
      makers_program: ownId,
      duplicate_node_id: p => `ノード${p.node}のメッセージに2つの転送カウンターが交互に現れます。`,
      duplicate_servo_id: p => `ノード${p.nodes}がサーボID ${p.servo_id}を使用。1つの指令ですべて動きます。`,
      servos_without_id: p =>
        line(
          `ノード${p.nodes}がサーボID 0`,
          p.commanders ? `ノード${p.commanders}がID 0に指令中` : "今はID 0への指令なし",
        ),
      other_commands: p =>
        line(
          p.program,
          `${p.over_s}にArrayCommand ${p.messages}件`,
          p.servo_ids && `サーボID ${p.servo_ids}`,
        ),
      second_allocator: p =>
        line(
          `ノード${p.node}が${p.answers}回応答、最後は${p.ago_s}前`,
          p.program,
          p.ours_answers ? "hornbillも応答: 同じIDを2台に渡すおそれがあります" : "hornbillは控えています",
        ),
      allocator_off: asking,
      allocation_refused: p => `${asking(p)}。${refusals[p.refusal as keyof typeof refusals]?.(p) ?? ""}`,
      allocation_stuck: p =>
        p.node === undefined
          ? `${asking(p)}。固有IDの3つの部分のうち${p.parts}つだけ届きました。`
          : `${p.uid}にノードID ${p.node}を${p.times}回与えましたが、受信がありません。`,
      silent_node: p => `${p.heard_s}前に受信。${p.over_s}に要求${p.requests}件、応答0件`,
      answers_lost: p =>
        `${p.over_s}の要求${p.requests}件中${p.lost}件（${p.lost_pct}）に応答なし。多い順にノード${p.nodes}`,
      answers_slow: p =>
        `中央値${p.median_ms}、最大${p.slowest_ms}（ノード${p.node}）、${p.over_s}に応答${p.answers}件。中央値が${p.limit_ms}を超えるノード${p.nodes}`,
      servo_offline: p => line(`最後の受信は${p.heard_s}前`, p.node && `ノード${p.node}`),
    },
  },
  remedy: {
    connect_adapter: () => "アダプターを選んで接続してください。",
    check_adapter: p => p.command ?? "アダプターとケーブルを確認し、接続し直してください。",
    as_adapter_says: p => p.problem ?? "",
    check_timing_and_wiring: () => "ビットレート、配線、終端を確認し、接続し直してください。",
    set_bit_timing: p =>
      p.command ??
      (p.sample_point_pct === undefined
        ? "1 Mbit/sでアダプターを接続し直してください。"
        : "サンプルポイント87.5 %でアダプターを接続し直してください。"),
    keep_one_allocator: () => "どちらか一方にしてください: 相手を止めるか、ノードIDでhornbill側を止めます。",
    turn_allocator_on: () => "ノードIDでオンにしてください。",
    free_node_id: () => "ノードIDで割り当てを確認してください。「忘れる」で1つ空きます。",
    find_short: () => "CAN_HとCAN_Lの短絡と、別のビットレートのノードを探してください。",
    set_bit_rate: () =>
      `すべてのノードとアダプターを、サーボのビットレートである1\u202fMbit/sにしてください。そうなっている場合は、CAN_HとCAN_Lの入れ違いまたは短絡、グランドの欠落、終端（${ENDS}）を調べてください。`,
    check_wires: () => WIRES,
    check_wires_and_baud: () => `${WIRES}アドレスの@以降を省くと、ボーレートが自動検出されます。`,
    free_serial_line: () =>
      "アダプターのボーレートを上げるか、このバスのサーボを減らすか、シリアル回線のないアダプターを使用してください。",
    check_plugs: () => `コネクターとケーブル、終端（${ENDS}）、スタブの長さを確認してください。`,
    slow_sender: () => "何がそれほど多く送っているかをモニターで確認し、遅くするか、バスから外してください。",
    free_computer: () =>
      "このコンピューターに負荷をかけている他のものを閉じるか、バッファーの大きいアダプターを使ってください。",
    none_needed: () =>
      "負荷になるほかに害はありません。CAN FDフレームは、クラシックCANだけを扱うサーボを混乱させます。",
    renumber_node: () =>
      "一方をバスから外し、もう一方のノードID（パラメーター0x46）を0にして保存し、外した方を戻してください。",
    change_own_node_id: () =>
      "もう一方のプログラムを終了するか、環境変数HORNBILL_NODE_IDでhornbillに別のノードIDを指定して起動してください。",
    close_program: () =>
      "どちらか一方のプログラムを終了してください。サーボの応答を互いに自分宛てと取り違えます。または、環境変数HORNBILL_NODE_IDでhornbillに別のノードIDを指定して起動してください。",
    give_servo_ids: () => "各サーボに固有のサーボID（1～254、パラメーター0x45）を付け、保存してください。",
    silence_commander: () =>
      "ここからサーボを動かしたり設定したりする前に、相手の出力を止めてください。誰が送ったものでも、最後の指令が有効になります。",
    renumber_servos: () => "1台を除くすべてに別のサーボID（パラメーター0x45）を付け、保存してください。",
    check_node_and_restart: () =>
      `ノードがhornbillの応答を受信していないか、ノードからの送信が失われています: 配線と終端（${ENDS}）を確認し、その後ノードを再起動してください。`,
    check_node: () =>
      `ノードがhornbillの最後の応答を受信していません: 配線と終端（${ENDS}）を確認してください。`,
    check_worst_cable: () =>
      `最初に挙がったノードのコネクターとケーブルを確認し、次に終端（${ENDS}）を確認してください。`,
    check_computer: () =>
      "アダプターまたはこのコンピューターが混み合っていないか、バスに負荷がかかっていないかを確認してください。",
    check_supply: () => "電源を確認し、次にケーブルを確認してください。",
    check_cable_and_restart: () =>
      "送信はしていますが受信していないか、サーボではありません: ケーブルを確認し、その後電源を切って再起動してください。",
  },
} satisfies Said<typeof english>;
