/** What the server notes beside a value, in Japanese, by code. tests/contract holds it complete. */

import type { Codes } from "../../bench/codes";
import type { Facts } from "../../bench/facts";
import { LEASE_END, STOP_CAUSE, UNIT, who } from "./said";

const STATE: Readonly<Record<string, string>> = {
  identifying: "識別中",
  saving: "保存中",
  restarting: "再起動中",
  updating: "ソフトウェアの更新中",
  offline: "オフライン",
};
/** What showed it: so many pairs of Status and 0x08, and the last of them. */
const pairs = (p: Facts) => `連続${p.times}回、最後はStatus ${p.position}、0x08 ${p.angle_deg}`;
const unit = (code: string | undefined) => UNIT[code ?? ""] ?? code;
/** Who may be a servo in spite of it. */
const perhaps = (yes: string | undefined) =>
  yes
    ? "アクチュエータのStatusを送信しているため、サーボかもしれません。停止時はトルクオフを書き込みます。"
    : "";

export const notes = {
  problem: p => p.problem ?? "失敗しました。",

  heard: p =>
    `ノード${p.node_id}が${
      {
        commands: "サーボを指令しています。",
        allocates: "ノードIDを割り当てています。",
        autopilot: "オートパイロットのメッセージを送信しています。",
      }[p.what ?? ""] ?? "動作しています。"
    }`,

  not_in_servo: p => `${p.model}（ファームウェア${p.firmware ?? "不明"}）にこの行はありません。`,
  side_unknown: p => `${p.side}のこの行の値が不明です。`,
  identity_row: () => "サーボ1台に固有の行です。行を指定するか、固有の行を含めてください。",
  torque_row: () => "復元ではトルクを切り替えません。オフまたはブレーキを書き込むには行を指定してください。",
  torque_never_on: () =>
    "復元でトルクがオンになることはありません。同時に保存するか、トルクを別にオンにしてください。",

  too_many_dots: p => `ピリオドが${p.most}個を超えています。文章を短くしてください。`,
  invalid_syntax: p => `${p.format}の形式ではありません（${p.why}）。`,
  nested_too_deeply: () => "入れ子が深すぎます。1行に1つの値を書いてください。",
  not_an_object: () => "オブジェクトではありません。プロファイルは { で始まります。",
  not_a_table: p => `${p.field}は表です。1行に1つの値を書いてください。`,
  too_many_entries: p => `項目が${p.entries}個あります。${p.most}個までにしてください。`,
  values_missing: () => "値がありません。1つ以上書いてください。",
  unknown_field: p => `プロファイルの項目は${p.known}です。これを除くか、[values] の下に書いてください。`,
  not_text: p => `${p.field}は文字列です。引用符で囲んでください。`,
  too_long: p => `${p.field}が${p.characters}文字あります。${p.most}文字までにしてください。`,
  lone_surrogate: p => `${p.field}に不完全な文字があります。書き直してください。`,
  other_tables: p => `別の版の表で書かれています。今の表（${p.revision}）で値を検査しました。`,
  unit_not_text: () => '単位は文字列です（例: "ms"）。',
  unit_without_value: p => `${p.key}は単位だけで値がありません。除いてください。`,

  pin_unchanged: p => `すでにノードID ${p.node_id}で動作しています。このまま固定します。`,
  pin_at_restart: p =>
    `次に起動してノードIDを要求したとき、${p.node_id}を割り当てます。${p.now_on ? `それまでは${p.now_on}のままです。` : ""}`,
  pin_after_fixed: p =>
    `ノードID ${p.node_id}が設定されており（0x46）、要求しません。0x46を0にすると、固定したIDになります。`,
  id_freed: p =>
    `ノードID ${p.node_id}が空きました。このノードが再び要求すると、新しいノードとして扱います。`,
  id_changes_at_restart: p =>
    `ノードはオンラインで、再起動まではノードID ${p.node_id}のままです。その後は新しいノードとして割り当てます。`,

  no_status: () => "送信していますが、毎秒1回必要なNodeStatusを一度も送っていません。",
  this_server: () => "このサーバです。",
  another_hornbill: () => "別のhornbillです。",
  requesting_id: p =>
    p.count === "0"
      ? "今、ノードIDを要求しているノードはありません。"
      : `${p.count}台がノードIDを要求しています。割り当て表を確認してください。`,
  no_model_number: p =>
    `機種番号（0x50）がないため、このシリーズのサーボではありません。${perhaps(p.may_be_servo)}`,
  no_parameters: p =>
    `GetNodeInfoには応答しますが、GetSetには応答しません。読み出せるパラメータはありません。${perhaps(p.may_be_servo)}`,
  no_info: p => `GetNodeInfoに応答しません（${p.tries}回要求）。${perhaps(p.may_be_servo)}`,
  identity_not_received: () =>
    "識別していません。識別に必要な応答をまだ受信していません。オブザーバは何も要求しません。",

  not_pollable_yet: p => `${p.servo}は識別が終わっていないため、まだ周期的に読み出せません。`,
  polled_when_ready: p =>
    `${p.servo}は${STATE[p.state ?? ""] ?? "準備中"}です。準備ができると読み出しを始めます。`,
  not_polled_as_observer: () => "オブザーバは何も要求しないため、周期的に読み出しません。",

  log_limit: p => `上限の${p.limit_mb}に達しました。`,
  disk_slow: p => `ディスクが${p.within_s}以内に最後まで書き込めませんでした。`,
  disk_full: () => "ディスクに空きがありません。データフォルダのあるディスクを空けてください。",
  write_failed: p => `書き込めませんでした（${p.error}）。`,

  unit_unchecked: () => "メーカーの単位です。0度ではどの単位も同じ値のため、まだ確認していません。",
  unit_agreed: p => `Statusと0x08が${unit(p.unit)}で一致しました（${pairs(p)}）。`,
  unit_changed: p => `以前の測定は${unit(p.before)}、今回は${unit(p.unit)}です（${pairs(p)}）。`,
  unit_none_fits: p => `Statusと0x08が既知のどの単位でも一致しません（${pairs(p)}）。`,
  unit_forced: p => (p.this_servo ? "このサーボに指定されています。" : "指定されています。"),

  stop_reason: p => `理由: ${STOP_CAUSE[p.reason ?? ""] ?? p.reason}`,
  stop_of: p => `${who(p.by)}による停止を解除しました。`,
  stop_confirmed: p =>
    `${p.of}台中${p.confirmed}台が確認しました${p.within_ms === undefined ? "" : `（${p.within_ms}以内）`}。`,
  lease_taken: p => `${p.servos ? `${p.servos}の` : ""}動作権は最後の通信から${p.ttl_s}有効です。`,
  lease_ended: p => LEASE_END[p.why ?? ""]?.(p) ?? "動作権が終わりました。",
  profile_stored: p => `プロファイル「${p.profile}」（${p.rows}項目）を保存しました。`,
  profile_replaced: p => `プロファイル「${p.profile}」（${p.rows}項目）を置き換えました。`,
  profile_deleted: p => `プロファイル「${p.profile}」を削除しました。`,
  ram_only: () => "RAMだけの変更です。ROMには書き込んでいません。",
  servo_id_zero: () => "サーボIDを元に戻していないため、RAMでは0です。処理を再開するか、再起動してください。",
  login_from: p => `${p.address}から`,
  servo_forgotten: p => `${p.model ?? "機種不明"}、スナップショット${p.snapshots}件を削除しました。`,
  not_seen_for: p => `${p.idle_s}以上受信していません。`,

  commissioned: p =>
    `${p.servos}台中${p.done}台の初期設定が完了しました。${p.saved ? "" : "ROMには書き込んでいないため、再起動すると失われます。"}`,

  improved: p =>
    `${p.servo}は${p.hunted ? "ハンチングしていました" : p.before_ms ? `整定に${p.before_ms} msかかりました` : "整定しませんでした"}が、今は${
      p.after_ms ? `${p.after_ms} msで整定します` : "安定しています"
    }。ゲインはRAMにあります。残すには保存してください。`,
  not_better: p => `測定でより良いゲインは見つからず、${p.servo}は元のゲインのままです。`,
  ended_by_request: () => "要求により終了しました。",
  server_shutdown: () => "サーバが終了しました。",

  smoothing_on: () => "スムージング（0x22）がオンのため、スムージングを含めて測定しています。",
  limit_reached: () => "サーボの制限に達しました。結果は制御ループではなく制限によるものです。",
  limit_unknown: () => "通知を読み出せなかったため、制限に達したかどうか不明です。",

  other_servo: () => "サーボが異なる測定です。",
  other_set_up: () => "試験条件が異なります。",
  other_procedure: () => "測定手順のバージョンが異なります。",
  other_step: () => "ステップまたは整定範囲が異なります。",

  try_check_free: p =>
    `ホーンが拘束または過負荷になっていないか${p.torque_limit_pct === undefined ? "" : `、トルク制限${p.torque_limit_pct}が低すぎないか`}確認してください。`,
  try_lower_boost: p => `ブースト${p.boost_pct}を下げるか、デッドバンドを広げてください。`,
  try_lower_p: p =>
    `比例ゲインを${p.p_gain === undefined ? "下げるか" : `${p.p_gain}以下にするか`}、${p.d_gain === undefined ? "" : "微分ゲインを上げるか、"}「改善」でハンチングしない最も硬いゲインを探してください。`,
  try_higher_p: p =>
    p.p_gain === undefined
      ? "比例ゲイン（0x2C）を少しずつ上げてください。"
      : `比例ゲイン${p.p_gain}を試し、ハンチングしたら下げてください。`,
  try_supply: p => `電源${p.nominal_v}で測定してください。`,
  try_smoothing_off: () => "調整中はスムージング（0x22）をオフにしてください。",
  try_smaller_step: () => "小さいステップで測定するか、制限を上げてください。",
  try_narrow_deadband: () => "デッドバンド（0x2E）を狭くしてください。",
  try_raise_torque: () => "トルク制限を上げてください。",
  try_longer: () => "測定時間を長くするか、比例ゲインを上げてください。",
  try_check_bus: p => `指令の${p.missed_pct}が送信できませんでした。バスを確認し、もう一度測定してください。`,
  try_larger_amplitude: p => `振幅を${p.amplitude_deg}にするか、時間を長くして測定してください。`,

  deadband_dependence: p =>
    `小さい振幅（${p.amplitude_deg}）では応答が${p.drop_db} dB低くなります。デッドバンドまたは摩擦の影響です。`,
  saturation_dependence: p =>
    `大きい振幅（${p.amplitude_deg}）では応答が${p.drop_db} dB低くなります。速度またはトルクが飽和しています。`,

  unknowable_loaded_backlash: () =>
    "負荷がギヤを片側に押している間のモータの角度とバックラッシ（センサはホーン側にあります）。",
  unknowable_elasticity: () => "ホーンと負荷の間の弾性（センサはホーン側にあります）。",
  unknowable_torque: () => "N·m単位のトルク（サーボは最大トルクに対する割合だけを報告します）。",
  unknowable_resolution: () => "分解能0.1°より小さいノイズとバックラッシ。",
  gear_on_one_side: () =>
    "負荷がギヤを片側に押しています。負荷を外すか、負荷が摩擦より小さい位置で測定してください。",
  no_stop_in_range: () => "範囲内に停止位置はありません。",
  too_little_torque: () => "トルクの差が小さすぎます。トルクの上限を上げてください。",
  too_few_samples: () => "サンプルが足りません。バスを確認し、もう一度測定してください。",
} satisfies Codes["notes"];
