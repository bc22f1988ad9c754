/** Japanese titles, evidence and remedies of the doctor's findings. tests/contract checks that they are complete. */
import type { Facts } from "../bench/facts";
import { refusals } from "../text/ja/events";
import type { Translated } from "../text/language";
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

const controller = (p: Facts) => `コントローラは${CONTROLLER[p.controller ?? ""] ?? "不明"}`;

/** The known parts, joined. */
const line = (...parts: (string | undefined | false)[]) => parts.filter(Boolean).join("、");

const requesting = (p: Facts) => `${p.uid}が${p.over_s}に${p.times}回要求`;

/** Evidence for an adapter that cannot be used: how long, else the adapter's own message. */
const lost = (p: Facts) =>
  p.down_s === undefined
    ? (p.problem ?? "")
    : line(
        `${p.down_s}前から`,
        `それまでの再接続${p.reopened}回`,
        p.retry_in_s && `${p.retry_in_s}後に再試行`,
      );

const ownId = (p: Facts) =>
  line(
    `ノード${p.node}からhornbillのものでないフレーム${p.frames}件`,
    `他のノードへの要求${p.requests}件`,
    p.allocates && "ノードIDも割り当て",
    p.ours_allocates ? "hornbillもノードIDを割り当てています" : "hornbillはノードIDを割り当てていません",
  );

export const words = {
  well: {
    adapter: () => "アダプタまたは記録の再生は正常",
    bus_off: () => "バスに参加中",
    bit_rate: () => "ビットタイミング",
    no_traffic: () => "フレームを受信中",
    own_node_id: () => "hornbillのノードIDの重複なし",
    servos_without_id: () => "サーボID 0を共有するサーボなし",
    other_commands: () => "他からの指令なし",
    duplicate_node_id: () => "ノードIDの重複なし",
    duplicate_servo_id: () => "サーボIDの重複なし",
    second_allocator: () => "アロケータは1つ",
    allocation_stuck: () => "ノードIDの要求はすべて応答済み",
    frames_dropped: () => "フレームの取りこぼしなし",
    errors_rising: () => "エラーはないか、わずか",
    load_over_budget: () => "バス負荷は上限以内",
    silent_node: () => "要求に応答しないノードなし",
    responses_lost: () => "応答を受信中",
    responses_slow: () => "サーボの応答は時間内",
    serial_line_full: () => "シリアル回線に余裕あり",
    servo_offline: () => "検出後に途絶えたサーボなし",
    foreign_frames: () => "DroneCANフレームのみ",
    database: () => "変更は保存されています",
    disk_space: () => "ディスクに空きあり",
    computer_busy: () => "このコンピュータの処理は間に合っています",
    view: () => "3D表示は正常",
  },
  wrong: {
    no_bus: () => "バスに未接続",
    adapter_failed: () => "アダプタを開けません",
    adapter_lost: () => "アダプタ喪失",
    interface_down: () => "CANインターフェースが停止中",
    bus_off: p =>
      p.ago_s === undefined ? "hornbillのコントローラがバスオフ" : "hornbillのコントローラのバスオフが発生",
    bit_rate: () => "アダプタのビットレートの不一致",
    sample_point: p => `サンプルポイントが${p.sample_point_pct}（サーボは${p.wanted_sample_point_pct}）`,
    only_errors: () => "バス上はエラーフレームのみ",
    unacknowledged: () => "バス上はhornbillのみ",
    no_traffic: () => "バスからの受信なし",
    nothing_received: () => "シリアルアダプタからの受信が一度もなし",
    serial_line_full: () => "シリアル回線の容量超過: フレームが失われる可能性あり",
    adapter_silent: () => "アダプタからコマンドへの応答なし",
    bit_rate_fixed: () => "アダプタのCANビットレートは変更不可",
    baud_unknown: () => "アダプタのボーレートが不明",
    adapter_echoes: () => "アダプタによる送信フレームの折り返し",
    line_noise: () => "シリアル回線のノイズ",
    latency_timer: () => "FTDIチップのレイテンシタイマが長い",
    not_listen_only: () => "アダプタがリッスンオンリーでない",
    errors_rising: p => (p.rising ? "エラーの増加" : "エラーが多く、コントローラがエラーパッシブ"),
    load_over_budget: () => "バス負荷の上限超過",
    frames_dropped: () => "hornbillに届くまでのフレームの取りこぼし",
    foreign_frames: () => "DroneCAN以外のフレームあり",
    own_node_id: p => `hornbillのノードID ${p.node}を使う別のノード`,
    makers_program: p => `Futabaの設定ソフトがhornbillのノードID ${p.node}を使用中`,
    servos_without_id: p => `サーボID 0のサーボ${p.count}台: ID 0への指令で同時に動作`,
    other_commands: p => `ノード${p.node}がサーボに指令を送信中`,
    duplicate_node_id: p => `ノードID ${p.node}を使う2台のノード`,
    duplicate_servo_id: p => `同じサーボIDを使う${p.count}台のサーボ`,
    second_allocator: p => `ノード${p.node}もノードIDを割り当て中`,
    allocator_off: () => "ノードID待ちのノードあり、アロケータはオフ",
    allocation_refused: () => "ノードIDを割り当てられないノード",
    allocation_stuck: p =>
      p.node === undefined
        ? "ノードID待ちのまま進まないノード"
        : `割り当てたノードID ${p.node}を使わないノード`,
    silent_node: p =>
      p.servo === undefined ? `ノード${p.node}の応答なし` : `${p.servo}（ノード${p.node}）の応答なし`,
    responses_lost: () => "応答の欠落",
    responses_slow: () => "応答の遅れ",
    servo_offline: p => `${p.servo}がオフライン`,
    database: () => "変更が保存されていません",
    disk_space: p =>
      p.full ? "データフォルダのディスクに空きがありません" : "データフォルダのディスクの空きがわずか",
    computer_busy: () =>
      "このコンピュータが混み合っています: サーボの応答遅れや途絶は見かけだけの場合があります",
    view: () => "3D表示を実行できません",
  },
  evidence: {
    well: {
      adapter: p => line(p.address, `再接続${p.reopened}回`),
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
          : p.responses === undefined
            ? `ノード${p.node}が割り当てていましたが、現在はバス上にありません。`
            : `ノード${p.node}が${p.responses}回応答、最後は${p.ago_s}前。hornbill側はオフです。`,
      allocation_stuck: p => `現在要求中のノード${p.requests}台`,
      frames_dropped: p => `${p.over_s}に${p.frames}フレーム中0`,
      errors_rising: p => `${p.over_s}にエラー${p.errors}件`,
      load_over_budget: p =>
        `${p.over_s}で${p.load_pct}（上限${p.limit_pct}）、うちhornbillの要求が約${p.ours_pct}`,
      serial_line_full: p =>
        `${p.over_s}で${p.baud} baudの${p.load_pct}、回線は毎秒${p.frames_per_s}フレームまで`,
      silent_node: p => `バス上のノード${p.nodes}台`,
      responses_lost: p => `${p.over_s}の要求${p.requests}件中${p.lost}件に応答なし`,
      responses_slow: p =>
        `中央値${p.median_ms}、最大${p.slowest_ms}（ノード${p.node}）、${p.over_s}に応答${p.responses}件`,
      servo_offline: p => `接続後のサーボ${p.servos}台`,
      foreign_frames: p => `${p.over_s}に0件`,
      database: p => `未保存の変更${p.pending}件`,
      disk_space: p => `空き${p.free_mb}、全体${p.total_mb}`,
      computer_busy: p => `直近${p.over_s}の処理の遅れは最大${p.lag_s}`,
      view: () => "ページで表示したときに起動します",
    },
    wrong: {
      not_listen_only: p => notes.not_listen_only({ command: p.command ?? "" }),
      no_bus: () => "hornbillはアダプタなしで動作しています。",
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
          : `アダプタは${Number(p.bitrate) / 1e6}\u202fMbit/s、サーボは1\u202fMbit/s。${p.seconds_s}に受信${p.frames}フレーム`,
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
        `FTDIチップのレイテンシタイマが${p.latency_ms}です。1\u202fmsに設定すると応答が速くなります。`,
      foreign_frames: p => `${p.over_s}に標準、リモート、CAN FDのフレーム${p.frames}件（無視）`,
      own_node_id: ownId,
      makers_program: ownId,
      duplicate_node_id: p => `ノード${p.node}のメッセージに2つの転送カウンタが交互に現れます。`,
      duplicate_servo_id: p => `ノード${p.nodes}がサーボID ${p.servo_id}を使用。1つの指令ですべて動きます。`,
      servos_without_id: p =>
        line(
          `ノード${p.nodes}がサーボID 0`,
          p.commanders ? `ノード${p.commanders}がID 0に指令中` : "現在ID 0への指令なし",
        ),
      other_commands: p =>
        line(
          p.program,
          `${p.over_s}にArrayCommand ${p.messages}件`,
          p.servo_ids && `サーボID ${p.servo_ids}`,
        ),
      second_allocator: p =>
        line(
          `ノード${p.node}が${p.responses}回応答、最後は${p.ago_s}前`,
          p.program,
          p.ours_responds ? "hornbillも応答: 同じIDが2台に割り当てられるおそれあり" : "hornbillは待機中",
        ),
      allocator_off: requesting,
      allocation_refused: p => `${requesting(p)}。${refusals[p.refusal as keyof typeof refusals]?.(p) ?? ""}`,
      allocation_stuck: p =>
        p.node === undefined
          ? `${requesting(p)}。固有IDの3つの部分のうち${p.parts}つだけを受信しました。`
          : `${p.uid}にノードID ${p.node}を${p.times}回割り当てましたが、そのノードからの受信がありません。`,
      silent_node: p => `${p.last_seen_s}前に受信。${p.over_s}に要求${p.requests}件、応答0件`,
      responses_lost: p =>
        `${p.over_s}の要求${p.requests}件中${p.lost}件（${p.lost_pct}）に応答なし。多い順にノード${p.nodes}`,
      responses_slow: p =>
        `中央値${p.median_ms}、最大${p.slowest_ms}（ノード${p.node}）、${p.over_s}に応答${p.responses}件。中央値が${p.limit_ms}を超えるノード${p.nodes}`,
      servo_offline: p => line(`最後の受信は${p.last_seen_s}前`, p.node && `ノード${p.node}`),
      database: p => line(`${p.failing_s}前から`, `未保存の変更${p.pending}件`, p.error),
      disk_space: p => `空き${p.free_mb}、全体${p.total_mb}`,
      computer_busy: p => `直近${p.over_s}の処理の遅れは最大${p.lag_s}`,
      view: p => p.error ?? "",
    },
  },
  refusal: refusals,
  remedy: {
    connect_adapter: () => "アダプタを選んで接続してください。",
    check_adapter: p => p.command ?? "アダプタとケーブルを確認し、接続し直してください。",
    see_adapter_message: p => p.problem ?? "",
    check_timing_and_wiring: () => "ビットレート、配線、終端を確認し、接続し直してください。",
    set_bit_timing: p =>
      p.command ??
      (p.sample_point_pct === undefined
        ? "1 Mbit/sでアダプタを接続し直してください。"
        : "サンプルポイント87.5 %でアダプタを接続し直してください。"),
    keep_one_allocator: () =>
      "アロケータの一方を止めてください: 相手を止めるか、「ノードID」でhornbill側をオフにします。",
    turn_allocator_on: () => "「ノードID」でアロケータをオンにしてください。",
    free_node_id: () => "「ノードID」で割り当てを確認してください。「削除」でノードIDが空きます。",
    find_short: () => "CAN_HとCAN_Lの短絡と、別のビットレートのノードを探してください。",
    set_bit_rate: () =>
      `すべてのノードとアダプタを、サーボのビットレートである1\u202fMbit/sにしてください。既に1\u202fMbit/sの場合は、CAN_HとCAN_Lの入れ違いまたは短絡、グランドの欠落、終端（${ENDS}）を確認してください。`,
    check_wires: () => WIRES,
    check_wires_and_baud: () => `${WIRES}アドレスの@以降を省くと、ボーレートが自動検出されます。`,
    free_serial_line: () =>
      "アダプタのボーレートを上げるか、このバスのサーボを減らすか、シリアル回線のないアダプタを使用してください。",
    check_plugs: () => `コネクタとケーブル、終端（${ENDS}）、スタブの長さを確認してください。`,
    slow_sender: () => "送信の多いノードをモニタで確認し、送信周期を長くするか、バスから外してください。",
    reduce_computer_load: () =>
      "このコンピュータに負荷をかけている他のプログラムを終了するか、バッファの大きいアダプタを使用してください。",
    none_needed: () =>
      "バス負荷が増えるだけで害はありません。ただしCAN FDフレームは、クラシックCANのみに対応するサーボの通信を妨げます。",
    renumber_node: () =>
      "一方をバスから外し、もう一方のノードID（パラメータ0x46）を0にして保存し、外した方を戻してください。",
    change_own_node_id: () =>
      "もう一方のプログラムを終了するか、環境変数HORNBILL_NODE_IDでhornbillに別のノードIDを指定して起動してください。",
    close_program: () =>
      "どちらか一方のプログラムを終了してください。互いに相手宛ての応答を自分宛てとして受信します。または、環境変数HORNBILL_NODE_IDでhornbillに別のノードIDを指定して起動してください。",
    assign_servo_ids: () => "各サーボに固有のサーボID（1～254、パラメータ0x45）を付け、保存してください。",
    turn_off_commander: () =>
      "hornbillでサーボを動かしたり設定したりする前に、相手の送信を止めてください。送信元に関係なく、最後の指令が有効になります。",
    renumber_servos: () => "1台を除くすべてに別のサーボID（パラメータ0x45）を付け、保存してください。",
    check_node_and_restart: () =>
      `ノードがhornbillの応答を受信していないか、ノードの送信が失われています。配線と終端（${ENDS}）を確認し、その後ノードを再起動してください。`,
    check_node: () =>
      `ノードがhornbillの最後の応答を受信していません。配線と終端（${ENDS}）を確認してください。`,
    check_worst_cable: () =>
      `最初に挙がったノードのコネクタとケーブルを確認し、次に終端（${ENDS}）を確認してください。`,
    check_computer: () =>
      "アダプタまたはこのコンピュータが混み合っていないか、バスに負荷がかかっていないかを確認してください。",
    check_supply: () => "電源を確認し、次にケーブルを確認してください。",
    check_cable_and_restart: () =>
      "送信はしていますが受信していないか、サーボではありません。ケーブルを確認し、電源を入れ直してください。",
    check_database: () =>
      "データベースが動作していること、そのディスクに書き込めて空きがあることを確認してください。",
    free_disk: () => "不要なログと記録を削除するか、ほかの方法で空きを作ってください。",
    see_server_log: () => "サーバのログを確認してください。ほかの機能は使用できます。",
  },
} satisfies Translated<typeof english>;
