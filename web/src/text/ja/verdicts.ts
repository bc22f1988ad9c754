/** Verdicts on runs in Japanese, by code. tests/contract holds it complete. */

import type { Codes } from "../../bench/codes";
import type { Facts } from "../../bench/facts";

const at = (rate: string | undefined) => (rate === undefined ? "" : `${rate}で`);
const settled = (p: Facts) => (p.settling_ms === undefined ? "" : `${p.settling_ms}で整定します。`);
const margin = (p: Facts) =>
  p.phase_margin_deg !== undefined
    ? `位相余裕${p.phase_margin_deg}。`
    : p.gain_margin_db !== undefined
      ? `ゲイン余裕${p.gain_margin_db} dB。`
      : "";
const follows = (p: Facts) =>
  `${p.bandwidth_hz === undefined ? `${p.from_hz}～${p.to_hz}の範囲で追従します。` : `${p.bandwidth_hz}（−3 dB）まで追従します。`}${margin(p)}`;
const WHY: Readonly<Record<string, (p: Facts) => string>> = {
  deadband: p => `デッドバンド（${p.dead_band_deg}）の範囲内です。`,
  torque_limit: p => `負荷や摩擦に対して、トルク制限${p.torque_limit_pct}または比例ゲインが不足しています。`,
  load: () => "負荷または摩擦によるものです。",
};

export const verdicts = {
  settles: p => `良好: ${p.settling_ms}で整定し、ハンチングはありません。`,
  did_not_move: p => `動きませんでした: ${p.step_deg}のうち${p.moved_deg}。`,
  smoothing_measured: p => `スムージングがオンのため、スムージングの応答を測定しています。${settled(p)}`,
  hunts: p =>
    p.boost_pct !== undefined
      ? `ブースト${p.boost_pct}で、${at(p.rate_hz)}±${p.swing_deg}ハンチングしています。`
      : `${at(p.rate_hz)}±${p.swing_deg}ハンチングしています。この負荷には比例ゲイン${p.p_gain ?? ""}が高すぎます。`,
  supply_limited: p => `電源が${p.supply_v}（定格の${p.supply_pct}）のため、速度とトルクが制限されています。`,
  limit_reached: p => `制限に達しました（${p.keys ?? "不明"}）。結果は制御ループではなく制限によるものです。`,
  off_target: p =>
    `目標の${p.error_deg}${p.side === "before" ? "手前" : "先"}で止まります。${WHY[p.why ?? ""]?.(p) ?? ""}`,
  rings: p => `${at(p.rate_hz)}振動が残り、目標を${p.swings}回越えます。${settled(p)}`,
  overshoots: p => `${p.overshoot_pct}行き過ぎます。${settled(p)}`,
  slow: p => `遅い応答: ${p.settling_ms}で整定し、ハンチングはありません。`,
  not_settled: p => `${p.dwell_s}以内に±${p.band_deg}に整定しません。`,
  not_reliable: () => "どの周波数でも信頼できません。指令と動きの関連が弱すぎます。",
  resonant: p =>
    `${p.peak_hz}で+${p.peak_db} dBの共振があります。${margin(p)}この負荷には比例ゲイン${p.p_gain ?? ""}が高めです。`,
  low_margin: p => `ハンチングに近い状態です。${margin(p)}`,
  amplitude_dependent: p => `${follows(p)}応答は振幅によって変わります。`,
  follows: p => follows(p),
} satisfies Codes["verdicts"];
