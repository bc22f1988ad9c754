/** Why a row has no effect now, in Japanese, by the code of the reason. tests/contract holds it complete. */

const OUT = "出力はオフです。範囲に戻ると自動で復帰しますが、直前の指令は失われます。";
const ANGLE_ONLY = "角度保持中にだけ働きます。";

export const why: Readonly<Record<string, string>> = {
  torque_off_drops_command: "トルク（0x20）がオフです。オンにするとこの指令は失われます。",
  brake_drops_command: "ブレーキ中です（0x20）。トルクをオンにするとこの指令は失われます。",
  mode_off: "0x25がオフです。",
  mode_off_absent: "このファームウェアに0x25はありません。",
  mode_off_counts_turns: "0x25がオフで、角度指令は常に多回転です。",
  mode_off_counts_turns_absent: "このファームウェアに0x25はなく、角度指令は常に多回転です。",
  mode_off_no_speed_loop: "0x25がオフで、速度ループがありません。",
  mode_off_no_speed_loop_absent: "このファームウェアに0x25はなく、速度ループがありません。",
  angle_counts_turns: "直前の指令が角度で、角度指令は常に多回転です。",
  only_while_angle_held: `直前の指令は{last_command}です。${ANGLE_ONLY}`,
  no_speed_loop_under_torque: "直前の指令はトルクです。速度ループは角度と速度の指令で働きます。",
  angle_limits_for_angle_only: "直前の指令は{last_command}です。動作角度制限は角度指令だけに働きます。",
  speed_limits_not_for_torque: "直前の指令はトルクです。動作速度制限は角度と速度の指令で働きます。",
  timeout_holds: "0x26が「ホールド」です。",
  no_i_gain: "0x31が0で、制限するものがありません。",
  pwm_speed_mode_off: "PWMが速度を指令し（0x37）、0x25がオフです。",
  no_torque_no_angle: "0x20がオンでなく、角度を保持していません。",
  no_torque_no_motion: "0x20がオンでなく、動作していません。",
  software_update: "ソフトウェアを更新中です。",
  motor_failure: "障害（0x1B）のためモータ出力がありません。",
  temperature: `温度（0x0B）が制限の範囲外です。${OUT}`,
  supply: `電源電圧（0x0C）が制限の範囲外です。${OUT}`,
  soft_start: "ホーンが0°に着くまで、ソフトスタート（0x21）が独自の値を使います。",
  configuration_lost: "保存した設定を読み込めませんでした（0x1A）。hornbillはこのサーボを動かしません。",
  not_saved: "保存すると、次の起動から働きます。",
};
