/** What to know before a command, in Japanese, by code. tests/contract holds it complete. */
import type { Codes } from "../../bench/codes";

export const cautions = {
  turns: p => `${p.servo}は${p.to_deg}までに${p.turns}回転します。多回転を数え、すべて回ります（4.17）。`,
  turn_count: p =>
    `${p.servo}は${p.before_deg}で再起動し、回転数を失いました。±180°を超える角度は検出されず、数えているだけです（4.1）。次の動作は逆向きになることがあります。`,
  continuous_rotation: p => `この指令では${p.servo}の動作制限角度は効かず、止まらずに回り続けます（4.31）。`,
  below_minimum: p =>
    `${p.servo}は${p.value}に従わないことがあります。絶対値が${p.smallest}未満の値は、0を除いて使用できません。0か、±${p.smallest}以上を指令してください。`,
  timeout_hold: p =>
    `通信が途絶えると、${p.servo}は直前の指令を保持します（0x26が「ホールド」）。hornbillやケーブルに異常があると動き続けます。先に0x26をオフかブレーキにしてください（4.19）。`,
  pwm: p => `${p.servo}にはPWM入力があります。CANの最後の指令から${p.timeout_ms}でPWMに従います（4.30）。`,
  timeout_too_short: p =>
    `${p.servo}は指令から${p.timeout_ms}でタイムアウトします（0x27）。hornbillが指令を繰り返すには${p.shortest_ms}以上が必要です。このままでは出力がオフになります。0x27を${p.shortest_ms}以上にしてください（4.19）。`,
} satisfies Codes["cautions"];
