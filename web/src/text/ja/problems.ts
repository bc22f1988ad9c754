/** What went wrong, in Japanese: by the cause of a problem, else by its code. tests/contract holds it complete. */
import type { Facts, FactsText } from "../../bench/facts";
import { live } from "../../motion/text.ja";
import { readable } from "../holder-name";

const BUS = "サーボの電源、CAN_H、CAN_L、グランド、終端（両端に120\u202fΩ）を確認してください。";
const KIND: Readonly<Record<string, string>> = { angle: "角度", speed: "速度", torque: "トルク" };
const TORQUE: Readonly<Record<string, string>> = { on: "オン", off: "オフ", brake: "ブレーキ" };
/** What a servo does that is not ready. */
const STATE: Readonly<Record<string, string>> = {
  identifying: "識別中です",
  saving: "保存中です",
  restarting: "再起動中です",
  updating: "ソフトウェアを更新中です",
  soft_start: "ソフトスタート中です（ホーンが0°へ移動中）",
  protected: "保護動作中です（出力はオフで、自動で復帰します）",
  offline: "オフラインです",
};

export const who = (name: string | undefined) => readable(name ?? "別のクライアント", live.motion.holder);
/** The unit of a value with its space. */
const u = (p: Facts) => (p.unit ? `\u202f${p.unit}` : "");

export const codes: Readonly<Record<string, FactsText>> = {
  bad_table: () => "パラメータ表に誤りがあります。",
  store_failed: () => "データベースを使用できません。データフォルダとディスクを確認してください。",
  log_failed: () => "ファイルを読み書きできません。データフォルダとディスクを確認してください。",
  bus_trouble: () => "アダプタまたはバスに問題があります。アダプタとケーブルを確認してください。",
  cannot_start: () => "サーバを起動できません。",
  bus_open_failed: () => "バスを開けません。アダプタの接続とアドレスを確認してください。",
  bus_disconnected: () => "バスに接続していません。アダプタを接続してください。",
  bus_read_only: () => "このバスには何も送信できません。",
  no_response: () => "サーボが応答しません。電源と配線を確認してください。",
  refused_by_servo: () => "サーボが要求を拒否しました。",
  did_not_move: () => "ホーンが指令どおりに動きませんでした。",
  unexpected_result: () => "サーボの値が書き込んだ値と異なります。",
  interrupted: () => "途中でサーバが終了しました。どこまで実行されたかは不明です。",
  forbidden_parameter: () => "このレジスタには触れません。何も送信していません。",
  not_available: () => "この環境では使用できません。",
  unknown_servo: p =>
    p.uid && p.uid.length < 32
      ? `ラベルまたはシリアル番号が${p.uid}のサーボはありません。`
      : "このサーボはもう登録されていません。",
  unknown_parameter: () => "そのパラメータはありません。",
  unknown_job: () => "その処理はもうありません。",
  unknown_lease: () => "その動作権はもうありません。",
  unknown_uid: () => "その固有IDはありません。",
  unknown_log: () => "そのログはありません。",
  unknown_snapshot: () => "そのスナップショットはありません。",
  unknown_profile: () => "そのプロファイルはありません。",
  unknown_run: () => "その測定はありません。",
  unknown_stream: () => "そのストリームはありません。",
  unknown_fault: () => "その異常はありません。",
  unknown_recording: () => "その記録はありません。",
  unknown_token: () => "そのトークンはありません。",
  no_simulator: () => "このサーバにシミュレータはありません。",
  no_autopilot: () => "シミュレーションのオートパイロットはありません。",
  no_verification: () => "実行中の検証はありません。先に開始してください。",
  not_in_this_model: () => "この機種またはファームウェアにはありません。",
  read_only: () => "読み出し専用です。",
  out_of_range: p =>
    p.minimum === undefined
      ? "範囲外です。"
      : `${p.requested}${u(p)}は範囲外です。${p.minimum}～${p.maximum}${u(p)}を入力してください。`,
  invalid_value: () => "値が正しくありません。",
  mode_off: () => "速度・トルク制御（0x25）がオフです。",
  torque_off: () => "トルクがオフです。",
  torque_on: () => "トルクがオンです。先にオフにしてください。",
  position_unit_unconfirmed: () => "位置の単位が不明です。",
  lease_required: () => "先に動作権を取ってください。",
  lease_held: p => `${who(p.holder)}が動作権を持っています。要求するか、待ってください。`,
  stopped: () => live.motion.whileStopped,
  busy: () => "サーボは準備中または処理中です。終わってから再試行してください。",
  commanded_elsewhere: () => "別のノードがサーボを指令しています。",
  conflict: () => "他で使用中です。",
  bus_budget: () => "バスに余裕がありません。",
  needs_confirmation: () => "確認が必要です。",
  configuration_lost: () =>
    "サーボは保存値を失い、初期値で動いています。記録からスナップショットを復元するか、現在の値を保存してください。",
  forbidden_origin: () => "このページまたはホスト名からの要求は受け付けません。",
  unauthorized: () => "トークンが必要です。このページでサインインしてください。",
  forbidden_role: p => `このトークンの権限は「${p.role}」です。必要な権限は「${p.needed}」です。`,
  too_many_attempts: p => `失敗が続きました。${p.retry_after_s}後にやり直してください。`,
  unsupported_media_type: () => "データの形式が正しくありません。",
  too_large: () => "データが大きすぎます。",
  idempotency_key_reused: () => "このキーは別の要求で使われました。",
  stale_revision: () =>
    "別のクライアントがこのサーボを変更しました。現在の値を確認してから、再試行してください。",
  not_found: () => "見つかりません。",
  method_not_allowed: () => "この操作はできません。",
  internal: () => "hornbillの内部でエラーが発生しました。報告してください。",
  no_link: () => "hornbillが応答しません。",
  // The page's own: an HTTP status or a message of the browser.
  unexpected: p => `予期しない応答です（${p.summary}）。`,
};

export const causes: Readonly<Record<string, FactsText>> = {
  adapter_ambiguous: p =>
    `${p.address}に当てはまるアダプタが複数あります。シリアル番号で指定してください: ${p.others}。`,
  adapter_lost: p => `${p.address}が失われました。アダプタとケーブルを確認してください。`,
  adapter_not_found: p =>
    `アダプタ${p.address}はありません。${p.others ? `次から選んでください: ${p.others}。` : "接続してください。"}`,
  adapter_removed: () => `取り外されています。接続し直してください。`,
  adapter_unconfirmed: () => `シリアルポートの先にCANアダプタがあるかどうかは分かりません。`,
  address_is_recording: p =>
    `${p.address}は記録です。読み書きも動作もできません。アダプタを接続してください。`,
  allocation_busy: p => `ノードID ${p.node_id}のサーボは処理中です。終わるまで割り当てを削除できません。`,
  allocation_not_found: p => `${p.uid}のノードIDの割り当てはありません。`,
  already_requested: p => `すでに${who(p.by)}が動作権を求めています。決まるまで待ってください。`,
  amplitude_out_of_range: p =>
    `振幅${p.amplitude_deg}は上限${p.largest_deg}を超えています。小さい値を入力してください。`,
  angle_unknown: p => `${p.servo}の角度が分かりません。電源と配線を確認してください。`,
  baud_unknown: p =>
    `${p.address}は開いていますが、一度も受信していません。ボーレートが不明で、${p.baud} baudを試しています。${BUS}アダプタ固有のボーレートがあれば、アドレスの末尾に@BAUDを付けてください。`,
  baud_unsupported: p =>
    `${p.address}を${p.bauds} baudに設定できません。ドライバが対応していません。別のボーレートを選んでください。`,
  bench_in_use: p =>
    `ベンチ${p.bench}は${p.host}のサーバが使用しています。そのサーバを停止するか、別の名前を--benchで指定してください。`,
  before_out_of_range: p => `${p.minimum_s}～${p.maximum_s}で指定してください。`,
  between_steps: p =>
    `${p.requested}${u(p)}は刻みの間の値です。${p.nearest}${u(p)}のいずれかを入力してください。`,
  beyond_array_command_range: p =>
    `${p.requested}°は±180°を超えています。ArrayCommandは多回転を送れません。${p.servo}を単独で指令してください。`,
  beyond_half_turn: p =>
    `${p.key}の${p.requested}${u(p)}は${p.turns}回転です。±180°を超える角度は数えているだけで、電源を切ると失われます。`,
  beyond_model_limit: p =>
    `${p.requested}${u(p)}は範囲外です。${p.minimum}～${p.maximum}${u(p)}を入力してください。`,
  beyond_servo_limit: p =>
    `${p.requested}${u(p)}は${p.servo}の${p.limit}を超えています。${p.minimum}～${p.maximum}${u(p)}を入力するか、先に制限を変更してください。`,
  bit_rate_mismatch: p =>
    `${p.interface}は${p.bitrate} bit/sで動作しています（必要なのは${p.wanted_bitrate} bit/s）。次のコマンドで設定してください: ${p.command}`,
  bit_rate_unsupported: p => `${p.bitrate} bit/sは使えません。サーボの出荷時は1000000 bit/sです。`,
  body_not_json: () => `データがJSONではありません。`,
  body_too_large: p => `データが大きすぎます。${p.limit_kb} kBまでにしてください。`,
  brake_not_acknowledged: p => `${p.servo}がブレーキに応答しません。トルクをオフにします。`,
  broadcast_id: () => `サーボID 255はバスの全サーボを動かします。1～254を使ってください。`,
  bus_address_invalid: p =>
    `「${p.address}」はバスのアドレスではありません。socketcan:can0のように書いてください。`,
  bus_disconnecting: () => `バスを切断中のため、動かしません。`,
  bus_lost: () => `バスが失われています。戻ってから指令し直してください。`,
  bus_lost_during_command: () => `指令の途中でバスが失われました。トルクはオフになります。`,
  bus_not_connected: p => `${p.address}に接続していません。バスを接続してください。`,
  bus_off: p =>
    `${p.address}はエラーが多く、バスオフです。ビットレート、配線、終端を確認し、接続し直してください。`,
  bus_option_required: p =>
    `${p.address}は開けません。トークンが必要なサーバでは、起動時に--busで指定してください。`,
  candle_channel_invalid: p => `${p.address}はSERIAL_NUMBERまたはSERIAL_NUMBER/CHANNELの形式ではありません。`,
  candle_package_missing: p =>
    `${p.address}に必要なPythonパッケージがありません。pip install 'hornbill[candle]'でインストールしてください。`,
  changed_since_read: p => `${p.servo}は読み出し後に変更されました。もう一度読み出してください。`,
  channel_invalid: p => `「${p.channel}」は${p.interface}のチャンネルではありません。`,
  channel_names_unavailable: p =>
    `ドライバからチャンネル名を取得できません。アドレスを${p.interface}:CHANNELの形で入力してください。`,
  channel_not_found: p => `アダプタにチャンネル${p.channel}はありません。0～${p.highest}を選んでください。`,
  channel_not_numeric: p => `${p.key}は数値ではないため、チャンネルにできません。`,
  closed_while_opening: p => `${p.address}は開いている途中で閉じられました。`,
  command_in_profile: p => `${p.key}はホーンを動かす指令で、設定ではありません。除いてください。`,
  command_superseded: p => `${p.servo}は整定する前に別の指令を受けました。`,
  commanded_by_other_stream: p => `${p.servo}は別のストリームが指令しています。先に終了してください。`,
  commanded_by_stream: p =>
    `${p.servo}はストリームが指令しています。ストリームで値を送るか、先に終了してください。`,
  commanded_elsewhere: p => `${p.servo}はノード${p.node_id}が指令しています。先にその指令を止めてください。`,
  commands_interrupted: p => `${p.servo}への指令が途切れていました。`,
  commands_unsupported: p =>
    `${p.servo}は${KIND[p.kind ?? ""] ?? p.kind}指令を受け付けません。0x25はファームウェア${p.since}からです。角度を指令してください。`,
  computer_busy: p =>
    `このコンピュータが混み合い、処理が最大${p.lag_s}遅れました。負荷を減らしてから、もう一度実行してください。`,
  control_request_not_found: () => `この要求はもうありません。もう一度要求してください。`,
  control_transfer_in_progress: () => `動作権がちょうど移るところです。1秒後にやり直してください。`,
  control_transfer_pending: p =>
    `動作権は要求していた${who(p.by)}に移るところです。1秒後にやり直してください。`,
  could_switch_off: p =>
    `${p.key}を${p.requested}${u(p)}にすると、今すぐ出力が切れる可能性があります${p.reading === undefined ? "（測定値は不明）" : `（測定値${p.reading}${u(p)}、余裕±${p.margin}${u(p)}）`}。`,
  cursor_invalid: () => `一覧の続きが見つかりません。最初から読み直してください。`,
  data_folder_only: p =>
    `${p.address}は開けません。ネットワーク経由ではデータフォルダの記録だけを名前で開けます。`,
  delete_failed: p => `${p.name}を削除できません。`,
  demo_only: p => `${p.address}は開けません。公開デモではシミュレータだけを使えます。`,
  device_not_found: () => `そのデバイスはありません。アダプタを接続し、名前を確認してください。`,
  driver_not_loaded: p => `ドライバが読み込まれていません。次のコマンドを実行してください: ${p.command}`,
  driver_not_responding: () =>
    `ドライバが応答しません。アダプタを抜き差ししてください。直らない場合はコンピュータを再起動してください。`,
  driver_open_timeout: () =>
    `ドライバが応答せず、開けませんでした。アダプタを抜き差ししてからやり直してください。`,
  driver_refused: () => `ドライバが拒否しました。アダプタの接続とドライバを確認してください。`,
  duplicate_command: () => `同じサーボに2つの指令があります。1つにしてください。`,
  duplicate_id: p => `${p.key} ${p.requested}が2台のサーボに指定されています。それぞれ別にしてください。`,
  duplicate_servo: () => `同じサーボが2回指定されています。`,
  duration_too_short: p =>
    `${p.from_hz}には${p.duration_s}では短すぎます。${p.least_s}以上にするか、最低周波数を上げてください。`,
  fault_never_seen: p => `このサーボにその異常はありません（${p.key}）。`,
  file_name_invalid: p => `「${p.name}」という名前は使えません。`,
  file_name_missing: p => `${p.address}にファイル名がありません。file:can0.logのように書いてください。`,
  file_not_found: p => `「${p.name}」はありません。`,
  file_not_toml_or_json: () => `TOMLまたはJSONのファイルを指定してください。`,
  file_not_written: p => `記録を書き込めません（${p.error}）。データフォルダとディスクを確認してください。`,
  file_too_large: p => `ファイルが${p.limit_kb} kBを超えています。プロファイルは通常数kBです。`,
  file_unreadable: p => `${p.name}を読めません。名前と権限を確認してください。`,
  firmware_invalid: p =>
    `「${p.requested}」はファームウェアの版ではありません。1.300のように書いてください。`,
  firmware_not_for_model: p =>
    `${p.model}にファームウェア${p.firmware}はありません。次から選んでください: ${p.known}。`,
  firmware_unknown: p => `ファームウェア「${p.requested}」はありません。次から選んでください: ${p.known}。`,
  first_token_not_admin: () =>
    `最初のトークンの権限はadminにしてください。以後は全員にトークンが必要になり、ほかの権限ではトークンを作成できません。`,
  force_without_reason: () => `動作権を強制的に取るには理由を入力してください。監査記録に残ります。`,
  form_media_type: p => `ファイルを「${p.media}」として送ることはできません。`,
  frame_gap_out_of_range: p => `frame_gap_msは0～${p.longest_ms}で指定してください。`,
  frames_missing: p => `${p.name}に29ビット識別子のCANフレームがありません。`,
  frames_timeout: p =>
    `${p.address}を再生できません。${p.within_s}以内にフレームが見つかりませんでした。ファイルとディスクを確認してください。`,
  autopilot_end_beyond_limit: p =>
    `出力${p.output}の端がサーボの角度制限を超えています。振れ幅を減らすか、角度制限（0x38、0x39）を変えてください。`,
  autopilot_ends_order: p =>
    `出力${p.output}の端と中立の順序が正しくありません。反時計回りの端、中立、時計回りの端の順に大きくしてください。`,
  autopilot_output_range: p =>
    p.requested === undefined
      ? "そのような出力はありません。計画にある出力の番号を指定してください。"
      : `出力${p.requested}はありません。${p.minimum}～${p.maximum}を指定してください。`,
  autopilot_output_twice: p => `出力${p.output}が2回あります。出力は1回だけ指定してください。`,
  autopilot_servo_id: p =>
    `出力${p.output}はサーボID ${p.wanted_id}に指令しますが、サーボのIDは${p.servo_id}です。パラメータ0x45か出力の番号を変えてください。`,
  no_autopilot: () => "シミュレーションのオートパイロットはありません。先に追加してください。",
  no_verification: () => "実行中の検証はありません。先に開始してください。",
  package_missing: p =>
    `パッケージ${p.package}が必要です。次のコマンドでインストールしてください: ${p.install}`,
  parameter_file_line: p => `パラメータファイルの${p.line}行目を読めません。`,
  parameter_file_no_output: () => "DroneCANに割り当てた出力がパラメータファイルにありません。",
  parameter_file_too_long: () => "パラメータファイルが長すぎます。",
  frequencies_out_of_range: p => `最高周波数${p.to_hz}は最低周波数${p.from_hz}の2倍以上にしてください。`,
  guest_allocates_nothing: () =>
    "ゲストとして接続しているため、ノードIDを割り当てません。割り当てるには、役割をホストに変えてください。",
  hold_angle_unsupported: () => `保持できるのは速度とトルクの指令だけです。`,
  hold_not_renewed: p =>
    `継続の確認が時間内になく、${p.servo}にブレーキをかけました。いったん離して、押し直してください。`,
  horn_loaded: p =>
    `${p.servo}のホーンは${p.load_pct}のトルクで保持しており、${p.limit_pct}に制限すると落ちる可能性があります。負荷を取り除くか、先にトルクをオフにしてください。`,
  horn_moved: p =>
    `${p.servo}は${p.target_deg}で保持するはずでしたが、${p.angle_deg}へ動きました。出力を切ります。何が動かしたか確認してください。`,
  horn_off_position: p =>
    `${p.servo}のホーンが${p.angle_deg}にあり、指令していないのに${p.centre_deg}から離れています。トルクをオフにします。何が回しているか確認してください。`,
  horn_turning: p => `${p.servo}のホーンが動いています。静止するまで待ってください。`,
  horn_turning_before_save: p =>
    `${p.servo}のホーンが${p.speed_rpm}で動いています。保存していません。先に静止させてください。`,
  horn_turning_output_off: p =>
    `出力がオフの${p.servo}のホーンが${p.speed_rpm}で動いています。静止させてください。`,
  host_not_allowed: p =>
    `「${p.host}」はこのサーバの名前ではありません。次のいずれかを使ってください: ${p.known}。`,
  host_not_found: () => `そのホストはありません。ホスト名を確認するか、IPアドレスを入力してください。`,
  id_changed_since_prepared: p => `${p.servo}のサーボIDは準備の後に変わりました。やり直してください。`,
  id_exchange_failed: p => `${p.titles}の間のIDの受け渡しに失敗しました。`,
  id_in_use: p =>
    `${p.key} ${p.requested}は${p.owner_title}が使用中です。${p.free === undefined ? "空きはありません" : `${p.free}が空いています`}。`,
  id_not_accepted: p => `${p.servo}が${p.key} ${p.number}を受け付けませんでした。`,
  id_not_addressable: p =>
    `${p.servo}のサーボID ${p.requested}はArrayCommandで指定できません。固有のID（1～254）を付けるか、単独で指令してください。`,
  id_still_in_use: p => `${p.key} ${p.requested}はまだ${p.owner_title}が使っており、先に移せませんでした。`,
  id_used_by_other_servo: p =>
    `ID ${p.requested}は変更しない別のサーボのものです。別のIDにするか、そのサーボも変更してください。`,
  identification_incomplete: p => `${p.servo}はまだ識別されていません。準備ができるまで待ってください。`,
  identity_in_profile: p => `${p.key}はサーボごとの値です。除くか、IDと原点を含める指定をしてください。`,
  improve_binding: p =>
    `${p.servo}のホーンはステップの一方の端には届きますが、${p.angle_deg}の手前${p.away_deg}で止まります。その付近のリンケージの摩擦と端を確認してください。`,
  improve_noisy: p =>
    `${p.servo}の角度の読み値は静止時に${p.noise_deg}（RMS）ばらつき、上限の${p.most_deg}を超えています。センサー、磁石、電源を確認してください。`,
  improve_range_too_small: p =>
    `${p.servo}のホーンは${p.angle_deg}にあり、${p.minimum}°～${p.maximum}°の中に${p.least_deg}のステップとオーバーシュートの余地がありません。範囲を広げるか、ホーンを中へ動かしてください。`,
  improve_saturated: p =>
    `${p.servo}は過負荷か、拘束されています。トルク${p.torque_pct}でもホーンは${p.angle_deg}で、目標の${p.to_deg}に届きません。負荷を減らすか、トルク制限を上げてください。`,
  improve_stalled: p =>
    `${p.servo}のホーンは${p.angle_deg}で、目標の${p.to_deg}に届きません。拘束されていないか確認するか、角度Pゲインを上げてください。`,
  improve_timeout: p => `${p.servo}の改善は${p.time_s}以内に終わりませんでした。時間を長くしてください。`,
  improve_too_few_samples: p =>
    `${p.servo}の読み値は毎秒${p.rate_hz}しか得られません（必要なのは${p.least_hz}）。配線のフレーム損失とバスの負荷を確認してください。`,
  in_use: p => `${p.users ?? "別のプログラム"}が使用中です。先に終了してください。`,
  interface_bus_off: p =>
    `${p.interface}のコントローラがエラーでバスオフです。ビットレート、配線、終端を確認し、再起動してください: ${p.command}`,
  interface_down: p =>
    `インターフェース${p.interface}が停止しています。次のコマンドで起動してください: ${p.command}`,
  interface_not_found: p =>
    `CANインターフェース${p.interface}はありません。${p.others ? `このコンピュータにあるもの: ${p.others}。` : ""}${p.command ? `次のコマンドで作成できます: ${p.command}` : "アダプタを接続するか、別のインターフェースを選んでください。"}`,
  interface_not_visible: () =>
    `LinuxのドライバにはありますがCANインターフェースが見えません。コンテナでは--network hostで実行してください。`,
  interface_unsupported: p =>
    `「${p.interface}」というインターフェースはありません。使えるもの: ${p.known}。`,
  internal_error: p => `hornbillの内部でエラーが発生しました（${p.error}）。報告してください。`,
  job_cancelled: p => `${p.servo}の処理が中止されました。`,
  job_in_progress: p => `${p.servo}は処理中です。終わってからやり直してください。`,
  job_not_found: p => `処理${p.job}はありません。`,
  job_running: () => `このサーボは別の処理中です。終わるまで待ってください。`,
  kernel_without_socketcan: p =>
    `このカーネルはSocketCANを使えません。次のコマンドを実行してください: ${p.command}`,
  key_malformed: p => `Idempotency-Keyは1～${p.longest}文字の表示できるASCII文字1つにしてください。`,
  key_reused: () => `このIdempotency-Keyは別の要求で使われました。要求ごとに新しいキーを使ってください。`,
  label_of_recorded_servo: p =>
    `${p.servo}は記録のサーボです。名前を付けるには実際のバスを接続してください。`,
  last_command_not_accepted: p => `${p.servo}が最後の指令を受け付けませんでした。`,
  lease_does_not_cover: () =>
    `この動作権には含まれないサーボがあります。そのサーボの動作権を取ってください。`,
  lease_ended: () => `動作権は終わり、指令していたサーボのトルクはオフになりました。もう一度取ってください。`,
  lease_ended_during_command: () => `指令の途中で動作権が終わりました。トルクはオフになります。`,
  lease_held_by_other: p => `${who(p.holder)}が動作権を持っています。要求するか、待ってください。`,
  lease_missing: () => `先に動作権を取ってください。`,
  lease_of_key_ended: () => `このキーで取った動作権は終わりました。新しいキーで取り直してください。`,
  line_not_utf8: p => `${p.line}行目がUTF-8ではありません。UTF-8で保存してください。`,
  lines_invalid: p =>
    `${p.total_lines}行中${p.count}行を受け付けられないため、何も保存していません。最初は${p.line}行目です。`,
  linux_only: () =>
    `SocketCANはLinuxだけで使えます。slcan:COM3のように、アダプタのインターフェースを使ってください。`,
  loaded_horns: p =>
    `${p.servos}のホーンに負荷がかかっている可能性があります（ブレーキ中、回転中、または${p.load_pct}を超えるトルク）。今の位置で保持します。`,
  log_damaged: p => `${p.name}は壊れています。${p.frames}フレームより先を読めません。`,
  log_format_unknown: p =>
    `${p.name}は対応するログの形式ではありません。candump、ASC、BLF、またはCSVを指定してください。`,
  log_not_written: p => `${p.name}に書き込めません。`,
  log_running: p => `${p.name}を記録中です。先に終了してください。`,
  mavcan_address_invalid: p =>
    `${p.address}はMAVLinkのアドレスではありません。mavcan:DEVICE@BAUDかmavcan:udp:HOST:PORTに、必要なら?bus=N（1〜${p.buses}）を付けて入力してください。`,
  mavcan_key_in_address: () =>
    `アドレスは保存され表示されるため、署名の鍵を含められません。環境変数HORNBILL_MAVLINK_KEYを設定し、key=…を削除してください。`,
  mavcan_key_missing: p =>
    `${p.address}を使えません。オートパイロットはMAVLinkに署名し、署名のないメッセージを無視します。HORNBILL_MAVLINK_KEYにパスフレーズを設定し、hornbillを起動し直してください。`,
  mavcan_key_wrong: p =>
    `${p.address}を使えません。${p.variable}の署名の鍵がオートパイロットのものと違います。オートパイロットのパスフレーズを設定し、このコンピュータの時計を確認してください。`,
  mavcan_not_signed: p =>
    `${p.address}を使えません。鍵が設定されていますが、受信したMAVLinkに署名がありません。オートパイロットで署名を設定するか、HORNBILL_MAVLINK_KEYなしで起動してください。`,
  mavcan_refused: p =>
    `${p.address}を使えません。オートパイロットがCANバス${p.bus}の転送を拒否しました（結果${p.result}）。CAN_P${p.bus}_DRIVERを確認するか、?bus=Nで別のバスを選んでください。`,
  mavcan_silent: p =>
    `${p.address}を使えません。MAVLinkのハートビートを受信していません。ポートのプロトコルとボーレート、UDPではホストとポートを確認してください。`,
  mavcan_unsupported: p =>
    `${p.address}を使えません。オートパイロットがMAV_CMD_CAN_FORWARDに応答しません。CANの転送に対応したファームウェア（ArduPilot 4.2以降）が必要です。`,
  mavlink: p =>
    `${p.address}はMAVLinkを話しています。オートパイロットが接続されています。これを通してサーボに接続するには、ポートのボーレートを付けてmavcan:${p.device}@BAUDと入力してください。`,
  media_type_not_json: p =>
    `${p.media ? `データの形式「${p.media}」は使えません` : "データの形式が指定されていません"}。application/jsonで送ってください。`,
  message_invalid: () => `このソケットのメッセージではありません。`,
  mode_off: p =>
    `${p.servo}は${KIND[p.kind ?? ""] ?? p.kind}指令を無視します。先に速度・トルク制御（0x25）をオンにしてください。`,
  model_unknown: p => `機種「${p.requested}」はありません。`,
  motion_command: p => `${p.key}はホーンを動かす指令で、設定ではありません。`,
  multi_turn_moves: p =>
    `${p.servos}は1回転を超えて動くか、再起動で回転数を失っています。動かすには確認してください。`,
  multicast_bus_invalid: p =>
    `${p.address}はマルチキャストのバスではありません。mcast:N（Nは0〜255）と入力してください。`,
  name_in_use: p => `${p.name}はすでにあります。別の名前にするか、削除してください。`,
  names_unknown: p => `${p.names}はありません。次から選んでください: ${p.known}。`,
  no_bus: () => `バスに接続していません。アダプタを接続してください。`,
  no_data_at_baud: p =>
    `${p.address}は${p.baud} baudで開いていますが、バスから一度も受信していません。${BUS}`,
  no_data_at_given_baud: p =>
    `${p.address}は${p.baud} baudで開いていますが、一度も受信していません。@${p.baud}を省くとボーレートを検出します: ${p.device}。${BUS}`,
  no_data_received: p =>
    `${p.address}は開いていますが、一度も受信していません。${BUS}ビットレートも確認してください。`,
  no_driver: p =>
    `${p.interface}のドライバがインストールされていません。${p.command ? `Linuxではカーネルのドライバを使い、socketcan:can0として接続できます: ${p.command}` : "メーカーのドライバをインストールしてください。"}`,
  no_pending_request: () => `このIDで動作権を求めている人はもういません。`,
  no_permission: p =>
    `このユーザには使用する権限がありません。次のコマンドを実行し、ログインし直してください: ${p.command}`,
  no_simulator: () => `このサーバにシミュレータはありません。hornbill demoで起動してください。`,
  node_id_in_use: p =>
    `ノードID ${p.node_id}は別のノードが使用中です。別のIDを選ぶか、先にそのノードの電源を切ってください。`,
  node_id_mismatch: p => `${p.servo}はノード${p.wanted_node_id}ではなく${p.node_id ?? "–"}で応答しています。`,
  node_id_missing: p => `${p.servo}はオフラインです。ノードIDがありません。電源と配線を確認してください。`,
  node_id_not_free_yet: () => `指定したノードIDは、この中の別のサーボが使用中で、保存するまで空きません。`,
  node_id_out_of_range: p =>
    `ノードID ${p.requested}は割り当てられません。${p.minimum}～${p.maximum}を入力してください。`,
  node_id_reassigned: p =>
    `${p.servo}はノードID ${p.requested}を空けるはずでしたが、再び割り当てられました。別のツールが割り当てている可能性があります。`,
  node_id_reserved: p =>
    `ノードID ${p.node_id}は${p.owner}のものです。別のIDを選ぶか、先にその割り当てを削除してください。`,
  node_id_still_in_use: p =>
    `${p.servo}はノードID ${p.requested}で復帰しますが、そのIDはまだ${p.owner_title}が使っています。保存していません。先にそちらを保存するか、初期設定で入れ替えてください。`,
  node_ids_exhausted: () =>
    `退避に使えるノードIDがありません。使われていないノードの割り当てを削除してください。`,
  node_not_responding: p =>
    `ノード${p.node_id}が応答しません（${p.service}、${p.tries}回）。電源、ケーブル、バスを確認してください。`,
  not_a_number: p => `${p.key}には数値を入力してください${p.unit ? `（${p.unit}）` : ""}。`,
  not_a_recording: p =>
    `${p.name}はhornbillの記録ではありません。hornbillが書き出した.zipを指定してください。`,
  not_allowed_in_profile: p => `${p.key}はプロファイルに入れられません。除いてください。`,
  not_following: p =>
    `${p.servo}が指令に従いません。ホーンは${p.angle_deg}、目標から${p.away_deg}です。試験を終了しました。負荷の緩みを確認するか、角度比例ゲインを下げてください。`,
  not_identified: p => `${p.servo}はまだ識別されていないため、動かしません。`,
  not_in_firmware: p => `${p.servo}（ファームウェア${p.firmware}）に${p.key}はありません。`,
  not_in_source: p => `${p.servo}に${p.key}はありません。除いてください。`,
  not_in_stream: p =>
    `サーボ${p.uid}はこのストリームに含まれていません。開始時に指定したサーボを指定してください。`,
  not_on_bus: p => `${p.servo}がバス上にありません。電源と配線を確認し、処理を再開してください。`,
  not_playable: p => `${p.address}を再生できません。${p.why ?? ""}`,
  not_ready: p => `${p.servo}は${STATE[p.state ?? ""] ?? "準備中です"}。準備ができるまで待ってください。`,
  not_restorable: p => `${p.key}は設定ではないため、復元できません。除いてください。`,
  not_restored_yet: p =>
    `${p.servo}の行がまだ元の値に戻っていません: ${p.not_restored}。サーボが応答すると自動で戻します。`,
  not_resumable: () => `この処理は再開できません。`,
  not_simulated: p => `サーボ${p.uid}はシミュレータにありません。`,
  not_slcan: p =>
    `${p.address}から届くデータはslcanの形式ではありません。slcanアダプタの接続とボーレートを確認してください。`,
  not_stored_in_rom: p => `${p.key}はROMに保存されないため、設定ではありません。除いてください。`,
  observer_sends_nothing: () =>
    "オブザーバとして接続しているため、何も送信しません。送信するには、役割をゲストかホストに変えてください。",
  nothing_to_inject: () => `故障を注入する対象がありません。サーボを追加するか、他の種類を指定してください。`,
  nothing_to_write: p => `${p.side}から${p.servo}に書き込む値がありません。行を指定してください。`,
  offline: p => `${p.servo}はオフラインです。電源と配線を確認してください。`,
  one_source_required: () =>
    `プロファイルの元は、値、サーボ、スナップショットのうち1つだけ指定してください。`,
  open_failed: p => `${p.address}を開けません。`,
  origin_not_allowed: p =>
    `別のサイトからの要求は受け付けません。hornbillのページ（http://${p.host}/）を開いてください。`,
  other_command_active: p => `${p.servo}は与えた指令と異なる指令を保持しています。`,
  outcome_unknown: () =>
    `この要求は以前に始まり、実行されたかどうか不明です。現在の状態を確認してください。このキーでは再実行しません。`,
  output_not_maintained: p => `${p.servo}の出力がオンのままになりませんでした。`,
  output_not_switched_back: () => `保存のために切り替えた出力はそのままです。`,
  outputs_still_off: p => `${p.targets}台中${p.failed}台の出力がオフのままです: ${p.titles}。`,
  outside_all_models: p => `${p.key}の値は、どの機種の範囲にも入りません。`,
  outside_limits: p =>
    `${p.servo}のホーンは${p.requested}°にあり、角度制限（${p.minimum}～${p.maximum}°）の外です。出力をオンにすると動きます。手で内側へ回すか、制限を広げてください。`,
  own_node_id: p => `ノードID ${p.node_id}はhornbillが使っています。別のIDを選んでください。`,
  parameter_unknown: p => `「${p.key}」というパラメータはありません。`,
  playback_ended: () => `記録の再生が終わりました。もう一度再生するか、バスを接続してください。`,
  playback_in_progress: () => `記録を再生中です。バスを接続すると記録されます。`,
  playback_speed_invalid: p => `「${p.requested}」は再生速度として使えません。`,
  query_parameter_repeated: p => `${p.parameter}は1回だけ指定してください。`,
  query_parameter_unknown: p =>
    `${p.parameter}という指定はありません。${p.nearest ? `近い名前は${p.nearest}です。` : ""}何も変更していません。`,
  servo_ambiguous: p => `${p.name}というサーボが複数あります。UIDで指定してください。`,
  tests_missing: () => "測定項目がありません。1つ以上選んでください。",
  outside_range: p =>
    `${p.servo}のホーンは${p.angle_deg}で、範囲${p.minimum}～${p.maximum}の外にあります。先に範囲内へ動かしてください。`,
  range_not_possible: p =>
    `この範囲では測定できません。${p.minimum}～${p.maximum}の中で${p.least_deg}以上の範囲を入力してください。`,
  blocked_at_torque: p =>
    `許可されたトルク${p.torque_pct}でホーンが動きませんでした。拘束されていないか確認するか、トルクの上限を上げてください。`,
  not_measured: p => `${p.servo}の機械特性はまだ測定されていません。先に測定してください。`,
  plan_limit_exceeded: p =>
    `${p.servo}が制限値を超えました（${p.cycle}サイクル目、手順${p.step}）: ${p.value}${p.limit ? `、制限値${p.limit}` : ""}。`,
  plan_torque_not_on: p => `${p.servo}のトルクがオンになりませんでした。`,
  plant_invalid: p =>
    `シミュレーションの定数が無効です${p.names ? `（${p.names}）` : ""}。範囲はAPIの説明を確認してください。`,
  playback_stopped: p => `${p.address}の再生は終了しています。バスを接続し直してください。`,
  port_closed: p => `${p.address}は閉じています。バスを接続し直してください。`,
  position_unit_conflict: p =>
    `${p.servo}の位置の単位がStatusと0x08で一致しません。単独で指令するか、単位を指定してください。`,
  profile_angle_only: () => `動作プロファイルは角度の指令だけに使えます。`,
  profile_not_accepted: p =>
    `${p.targets}台中${p.failed}台がプロファイルを受け付けませんでした: ${p.titles}。`,
  profile_not_found: p => `プロファイル「${p.name}」はありません。`,
  profile_of_unknown_series: p =>
    `${p.servo}は未対応のシリーズのため、プロファイルを作成できません。スナップショットを作成してください。`,
  pyarrow_missing: () =>
    `pyarrowがないためParquetを書き出せません。pip install 'hornbill[parquet]'でインストールするか、CSVを使ってください。`,
  ram_unknown: p => `${p.servo}はバス上にないため、RAMの値は不明です。ROMと比較してください。`,
  read_during_soft_start: p =>
    `${p.servo}はソフトスタート中で、応答は実際の値ではありません。終わるまで待ってください。`,
  read_only: p => `${p.key}は読み出し専用です。`,
  read_only_in_profile: p => `${p.key}は読み出し専用です。除いてください。`,
  read_refused_before_write: p =>
    `${p.servo}が書き込み前の${p.key}の読み出しを拒否しました。何も書き込んでいません。やり直してください。`,
  real_time: () =>
    `このサーバは実時間で動いています。速度を変えるには「hornbill demo --speed 1」で起動してください。`,
  reading_not_settable: p => `別の値を読み出せるのは${p.known}だけです。`,
  recorded_servo: p => `${p.servo}は記録のサーボです。動かせません。実際のバスを接続してください。`,
  recording_damaged: p => `${p.name}は壊れています。`,
  recording_not_written: () => `記録を書き込めません。ディスクを確認してください。`,
  recording_unreadable: p => `${p.name}はこのhornbillで読めない記録です。`,
  recordings_folder_missing: () => `記録のフォルダがないため、記録していません。`,
  register_forbidden: p => `${p.key}はhornbillが読み書きしないレジスタです。`,
  register_refused: p =>
    `${p.servo}が${p.key}の${p.writes ? "書き込み" : "読み出し"}を拒否しました（値のない応答）。やり直してください。毎回同じ場合、このサーボにこの行はありません。`,
  released_before_settling: p => `${p.servo}は整定する前に指令が終了しました。`,
  released_before_start: p => `${p.servo}は動き出す前に離されました。`,
  replay_failed: p => `${p.address}の再生を続けられません。接続し直してください。`,
  request_malformed: p => `要求の形式が正しくありません（${p.where}）。`,
  reset_refused: p => `${p.servo}が初期化を拒否しました（ok = 0）。オフにしたトルク以外は変わっていません。`,
  response_gap: p => `${p.servo}の応答が途切れていました。`,
  restart_ignored: p => `再起動を${p.tries}回要求しましたが、${p.servo}は再起動しません。`,
  restart_not_seen: p =>
    `${p.servo}の再起動を${p.within_s}以内に確認できませんでした。ROMの値は不明です。電源を確認してください。復帰すると値を読み出します。`,
  restart_refused: p => `${p.servo}が再起動を拒否しました（ok = 0）。`,
  restarted_before_save: p =>
    `${p.servo}は保存の前に再起動し、RAMだけの値を失いました。保存していません。今の値を確認してください。`,
  restarted_before_write: p => `${p.servo}は書き込みの前に再起動しました。もう一度読み出してください。`,
  restarted_during_read: p => `${p.servo}は読み出し中に再起動しました。準備ができてからやり直してください。`,
  restarted_since_prepared: p => `${p.servo}は準備の後に再起動しました。やり直してください。`,
  restarts_repeatedly: p => `${p.servo}が再起動を繰り返すため、ROMの値は不明です。電源を確認してください。`,
  restarts_repeatedly_in_reset: p =>
    `${p.servo}が再起動を繰り返し、書き込んだ値が残りません。電源を確認してください。`,
  role_insufficient: p =>
    `トークン「${p.token}」の権限は「${p.role}」です。必要な権限は「${p.needed}」です。`,
  rom_unverified: p =>
    `${p.servo}は再起動しましたが、次のROMの値を確認できていません: ${p.keys}。確認するには、再起動後に読み出してください。`,
  rom_differs: p => `${p.servo}のROMが保存した値と異なります: ${p.keys}。`,
  rom_lost_during_save: p =>
    `${p.servo}は初期値で起動しました。ROMを読み込めず、保存値は失われています。書き込み中に電源が切れました。スナップショットを復元し、保存し直してください。`,
  row_not_in_model: p => `${p.key}はこの機種の行ではありません。`,
  row_not_in_servo: p => `${p.servo}に${p.key}はありません。`,
  rows_invalid: p => `${p.servo}の${p.count}行がこのサーボに合いません: ${p.keys}。`,
  rows_not_restored: p => `${p.servo}の行が元の値に戻っていません: ${p.keys}。`,
  run_not_found: p => `測定${p.run}はありません。`,
  runs_missing: () => `測定の番号を1～8個、カンマ区切りで指定してください。`,
  runs_on_defaults: p =>
    `${p.servo}は初期値で動いています。前回の起動で保存値を読み込めませんでした（警告ビット15）。そのため動かしません。スナップショットを復元して保存するか、今の値を保存してください。`,
  save_cancelled: p => `${p.servo}の保存は中止されました。ROMの値は不明です。`,
  save_outcome_unknown: p =>
    `その時点で${p.servo}がSAVEを受信していたか、ROMの内容がどうなっているかは不明です。`,
  save_refused: p => `${p.servo}が保存を拒否しました（ok = 0）。RAMの値は変わっていません。`,
  server_exited: () => `処理の途中でサーバが終了しました。完了した手順は処理の記録で確認してください。`,
  server_not_responding: () =>
    `サーバが応答しません。ホストに到達できるか、そのポートでsocketcandが動作しているか確認してください。`,
  server_not_running: () =>
    `接続先でサーバが動作していません。そのホストでsocketcandを起動し、ポートを確認してください。`,
  servo_id_in_use: p => `サーボID ${p.servo_id}は別のサーボが使用しています。`,
  servo_id_not_restored: p => `サーボIDはRAMで0です: ${p.servo_id ?? "–"}に戻せませんでした。`,
  servo_id_parked: p =>
    `サーボIDはRAMで0です（元は${p.servo_id ?? "–"}）。処理を再開するか、サーボを再起動してください。`,
  servo_never_seen: p => `サーボ${p.uid}は一度も検出されていません。`,
  servo_not_responding: p => `${p.servo}が応答しません。電源と配線を確認してください。`,
  servo_online: p => `${p.servo}は接続されています。電源を切るかバスから外してから、登録を削除してください。`,
  servo_restarted: p => `${p.servo}が再起動しました。`,
  settle_angle_only: () => `整定を待てるのは角度の指令だけです。`,
  shared_servo_id: p =>
    `${p.servo}と${p.owner_title}が同じサーボID ${p.requested}を使っており、両方が動きます。それぞれに固有のIDを付けるか、単独で指令してください。`,
  side_unknown: p =>
    `「${p.requested}」は比較できません。サーボ、スナップショット、プロファイル、初期値のいずれかを指定してください。`,
  sim_output_on: () =>
    `モータの出力がオンのため、手では回せません。先にトルクをオフにするか、電源を切ってください。`,
  sim_servo_invalid: () => "このサーボはシミュレータに追加できません。機種、ID、固有IDを確認してください。",
  slcan_bit_rate_unsupported: p => `slcanに${p.bitrate} bit/sはありません。`,
  slcan_setting_refused: p =>
    `${p.address}のアダプタが設定を拒否しました（BELL）。抜き差ししてからやり直してください。`,
  snapshot_has_previous_values: p => `以前の値はスナップショット${p.snapshot}にあります。`,
  snapshot_not_found: p => `スナップショット${p.snapshot}はありません。`,
  snapshot_not_stored: p =>
    `${p.servo}のスナップショットを保存できなかったため、何も書き込んでいません。データフォルダとディスクを確認してください。`,
  snapshot_of_other_servo: p => `スナップショット${p.snapshot}は別のサーボのものです。`,
  snapshot_of_unknown_model: p => `スナップショット${p.snapshot}は未対応の機種のものです。`,
  socketcand_address_invalid: p => `${p.address}はHOST:PORT/CHANNELの形式ではありません。`,
  socketcand_refused: p =>
    `${p.address}を開けません。socketcandサーバがこのCANインターフェースを提供しているか確認してください。`,
  soft_start_stuck: p =>
    `${p.servo}のホーンが15秒間0°で検出されず、ソフトスタートが終わっていない可能性があるため、ROMの速度とトルクの値を読み出せません。拘束されていないか確認し、再起動してください。`,
  some_servos_failed: p => `${p.targets}台中${p.failed}台で失敗しました: ${p.titles}。`,
  step_out_of_range: p =>
    `${p.step_deg}のステップ試験はできません。0以外の±${p.largest_deg}までを入力してください。`,
  step_path_differs: p =>
    `${p.servo}が前のステップと同じ経路を動きませんでした（ホーンは${p.angle_deg}）。拘束や制限を確認してください。`,
  steps_incomplete: () => `完了していない手順があります。`,
  stopped: p => `${who(p.by)}が停止しました。停止を解除するまで何も動きません。`,
  store_newer: () =>
    `データベースは新しい版のhornbillで作成されています。その版を使うか、別のデータフォルダを指定してください。`,
  store_rejected: () => `データベースがデータを受け付けません。サーバの記録を確認してください。`,
  store_timeout: () => `データベースが応答しません。しばらくしてからやり直してください。`,
  store_unusable: () => `データベースを使用できません。データフォルダとディスクを確認してください。`,
  stream_ended: () => `ストリームは終了しています。新しく開始してください。`,
  stream_not_found: p => `ストリーム${p.stream}はありません。`,
  stream_too_fast: p =>
    `${p.servos}台を${p.rate_hz}で動かすだけの余裕がバスにありません。周期を遅くするか、サーボを減らしてください。`,
  supply_out_of_range_reset: p =>
    `${p.servo}の電源電圧では初期化できません。何も初期化していません。電源電圧を確認してください。`,
  supply_out_of_range_save: p =>
    `${p.servo}の電源電圧${p.requested} Vでは保存できません（動作範囲${p.minimum}～${p.maximum} V）。保存していません。`,
  swings_too_far: p =>
    `${p.servo}の振れが大きすぎます。振幅${p.amplitude_deg}に対し、ホーンは開始位置から${p.away_deg}です。試験を終了しました。角度比例ゲインまたは振幅を下げてください。`,
  switched_off_during_command: p => `${p.servo}の出力が途中で切られたため、オンにしていません。`,
  switched_off_during_save: p => `保存中に${p.servo}の出力が切られました。保存し直してください。`,
  table_invalid: p => `パラメータ表${p.file ?? ""}に誤りがあります${p.row ? `（${p.row}）` : ""}。`,
  timeout_needs_lease: p =>
    `${p.servos}は通信タイムアウト（0x26、0x27）で出力が再び切れます。動作権を取ると、終わるまで出力を維持します。`,
  token_name_in_use: p => `トークン「${p.name}」はすでにあります。先に取り消すか、別の名前にしてください。`,
  token_name_invalid: () => `トークンの名前は英数字などの1～32文字にしてください。`,
  token_not_found: p => `トークン「${p.name}」はありません。`,
  token_required: () => `トークンが必要です。このページでサインインしてください。`,
  token_unknown: () =>
    `このトークンは登録されていません。取り消されたか、一部しか入力されていない可能性があります。`,
  too_many_attempts: p => `失敗が${p.count}回続きました。${p.retry_after_s}後にやり直してください。`,
  too_many_commands: p => `一度に指令できるのは1～${p.most}件です。`,
  too_many_errors: p =>
    `${p.address}でエラーが多いか、送信に応答（ACK）がありません。サーボの電源、ビットレート、配線、終端を確認してください。`,
  too_many_requests: p => `ノード${p.node_id}への要求が多すぎます。応答があってからやり直してください。`,
  torque_in_rom_unknown: p =>
    `${p.servo}のROMのトルク（0x20）が不明なため、保存で維持できません。起動のたびにトルクをオンにするか、オフのままにするかを選んでください。`,
  torque_is_off: p => `${p.servo}のトルクがオフのため、動きません。先にオンにしてください。`,
  torque_off_not_accepted: p => `${p.servo}のトルクがオフになりませんでした。以降の初期化は行っていません。`,
  torque_off_unconfirmed: p => `${p.servo}の出力オフは未確認です。書き込みを続けています。`,
  torque_on: p =>
    `トルクがオンのまま${p.key}を変えると${p.servo}のホーンが動きます。先にトルクをオフにしてください。`,
  torque_on_not_accepted: p => `${p.servo}のトルクがオンになりませんでした。`,
  torque_saved_to_rom: p =>
    `保存すると${p.servo}のROMのトルクが「${TORQUE[p.requested ?? ""] ?? p.requested}」になり、起動後、オンにするまで保持しません。`,
  torque_switched_off: p => `${p.servo}のトルクが途中でオフになりました。`,
  torque_unverified: p =>
    `トルクの値は確認できていません。起動後に出力が切り替わりました。確認するには${p.servo}を再起動してください。`,
  torque_unverified_stop: p =>
    `トルクの値は確認できていません。起動後に停止が書き込みました。停止を解除した後、${p.servo}を再起動して確認してください。`,
  turn_count: p =>
    `${p.servo}は${p.before_deg}で再起動し、回転数を失いました。次の動作は逆向きになることがあります（4.1）。動かすには確認してください。`,
  turns: p => `${p.servo}は${p.to_deg}までに${p.turns}回転します（4.17）。動かすには確認してください。`,
  unassigned_id: () =>
    `サーボID 0はIDのない全サーボのものです。一緒に動く可能性があります。1～254のID（0x45）を付けて使ってください。`,
  under_command: p => `${p.servo}は指令中です。再起動でトルクが切れるため、先に動作をオフにしてください。`,
  under_speed_command: p =>
    `${p.servo}は速度またはトルクの指令中です。先に角度を指令するか、トルクをオフにしてください。`,
  unique_for_many: p =>
    `プロファイル「${p.name}」には、2台が共有できない${p.key}が含まれます。1台だけに適用してください。`,
  unit_change_under_command: p =>
    `${p.servo}は指令中です。単位を変えると同じ角度が別の位置になります。先に指令を終了してください。`,
  unit_depends_on_other_row: p =>
    `${p.servo}の${p.key}の単位は「${p.stated}」ですが、ここでは「${p.unit}」です。${p.other}も一緒に復元してください。`,
  unit_mismatch: p =>
    `${p.key}の単位は${p.unit ? `「${p.unit}」` : "なし"}ですが、「${p.stated}」と書かれています。`,
  unknown_series: p =>
    `${p.servo}は未対応のシリーズ${p.series_number}（0x50）です。トルクオフ以外の動作と書き込みはできません。読み出し、スナップショット、比較はできます。`,
  unplugged: () => `開いている途中で抜けたか、応答しなくなりました。接続し直してください。`,
  unread_after_restart: p =>
    `${p.servo}は再起動しましたが、${p.within_s}以内に読み出せませんでした。ROMの値は不明です。電源と配線を確認してください。`,
  upload_too_large: p => `ファイルが${p.limit_mb}を超えています。時間の短いものを指定してください。`,
  value_changed_by_servo: p => `${p.servo}の${p.key}が書き込んだ値と異なります。`,
  value_unknown_in_source: p => `${p.servo}の${p.key}の値は不明です。除いてください。`,
  values_differ: p => `${p.servo}の値が指定と異なります: ${p.keys}。`,
  values_lost_before_save: p =>
    `${p.servo}が書き込んだ値を保持していません: ${p.keys}。再起動したか、他から書き込まれました。保存していません。`,
  virtual_time: p =>
    `${p.address}は開けません。このサーバは仮想時間で動いています。実際のサーボには--speedを付けずに起動してください。`,
  values_missing: () => `値のないプロファイルは作成できません。1つ以上の値を入れてください。`,
  values_not_storable: p =>
    `${p.servo}の元の値を保存できないため、何も変更していません。データフォルダとディスクを確認してください。`,
  values_owed: p =>
    `${p.servo}にまだ元に戻せない一時的な値があります: ${p.keys}。サーボが応答すると自動で戻します。電源と配線を確認するか、再起動してください。`,
  values_not_retained: p =>
    `${p.servo}はすべての値を受け付けましたが、その後の値が異なります: ${p.keys}。再起動したか、他から書き込まれています。`,
  wiggle_failed: p =>
    `${p.servo}のホーンが${p.moved ? "元の位置に戻りませんでした" : "動きませんでした"}（${p.back_deg}）。拘束されていないか、デッドバンド（0x2E）と速度・トルクの制限（0x3A～0x3D）を確認してください。`,
  wiggle_range_too_small: p =>
    `${p.servo}のホーンは${p.requested}°にあり、角度制限（${p.minimum}～${p.maximum}°）の中に往復する余地がありません。手で内側へ回すか、制限を広げてください。`,
  write_forbidden: () => `この書き込みは禁止されています。何も送信していません。`,
  write_never_allowed: p => `${p.key}には書き込みません。`,
  wrong_type: p => `${p.key}にこの値は使えません。`,
};
