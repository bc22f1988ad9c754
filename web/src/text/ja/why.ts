/** Owns why a row has no effect now, in Japanese, by the words of the server's tables. tests/contract holds it complete. */

const OUT = "出力はオフです。範囲に戻ると自動で復帰しますが、直前の指令は失われます。";
const ANGLE_ONLY = "角度保持中にだけ働きます。";

export const why: Readonly<Record<string, string>> = {
  "torque (0x20) is off, and turning it on drops this command":
    "トルク（0x20）がオフです。オンにするとこの指令は失われます。",
  "the servo brakes (0x20), and turning torque on drops this command":
    "ブレーキ中です（0x20）。トルクをオンにするとこの指令は失われます。",
  "speed and torque control (0x25) is off": "0x25がオフ。",
  "this firmware has no speed and torque control (0x25)": "このファームウェアに0x25はありません。",
  "speed and torque control (0x25) is off, and angle commands always count turns":
    "0x25がオフで、角度指令は常に多回転です。",
  "this firmware has no speed and torque control (0x25), and angle commands always count turns":
    "このファームウェアに0x25はなく、角度指令は常に多回転です。",
  "speed and torque control (0x25) is off, so there is no speed loop":
    "0x25がオフで、速度ループがありません。",
  "this firmware has no speed and torque control (0x25), so there is no speed loop":
    "このファームウェアに0x25はなく、速度ループがありません。",
  "the last command was an angle, and angle commands always count turns":
    "直前の指令が角度で、角度指令は常に多回転です。",
  "the last command was a speed; it acts while an angle is held": `直前の指令は速度です。${ANGLE_ONLY}`,
  "the last command was a torque; it acts while an angle is held": `直前の指令はトルクです。${ANGLE_ONLY}`,
  "the last command was a torque; the speed loop acts under angle and speed commands":
    "直前の指令はトルクです。速度ループは角度と速度の指令で働きます。",
  "the last command was a speed; angle limits hold for angle commands alone":
    "直前の指令は速度です。角度制限は角度指令だけに働きます。",
  "the last command was a torque; angle limits hold for angle commands alone":
    "直前の指令はトルクです。角度制限は角度指令だけに働きます。",
  "the last command was a torque; speed limits hold for angle and speed commands":
    "直前の指令はトルクです。速度制限は角度と速度の指令で働きます。",
  "the time-out action (0x26) is hold": "0x26が「保持」。",
  "the speed I gain (0x31) is 0, so there is nothing to limit": "0x31が0で、制限するものがありません。",
  "PWM asks for a speed (0x37), and speed and torque control (0x25) is off":
    "PWMが速度を指令し（0x37）、0x25がオフ。",
  "torque (0x20) is not on, so no angle is held": "0x20がオンでなく、角度を保持していません。",
  "torque (0x20) is not on, so there is no motion to shape": "0x20がオンでなく、動作していません。",
  "the servo's software is being replaced": "ソフトウェアを更新中です。",
  "the servo reports a failure (0x1B) that leaves the motor without output":
    "故障（0x1B）のためモーター出力がありません。",
  "output is off while the temperature (0x0B) is outside its limits; it comes back by itself, without the last command": `温度（0x0B）が制限の範囲外です。${OUT}`,
  "output is off while the supply voltage (0x0C) is outside its limits; it comes back by itself, without the last command": `電源電圧（0x0C）が制限の範囲外です。${OUT}`,
  "soft start (0x21) uses a value of its own until the horn is at 0°":
    "ホーンが0°に着くまで、ソフトスタート（0x21）が独自の値を使います。",
  "the saved configuration could not be loaded (0x1A), so hornbill does not move this servo":
    "保存した設定を読み込めませんでした（0x1A）。hornbillはこのサーボを動かしません。",
  "it acts at the next start, when it has been saved": "保存すると、次の起動から働きます。",
};
