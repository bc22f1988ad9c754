/** Japanese words shared by events and notes: clients, reasons of stops, ends of leases, units. */
import type { Facts } from "../../bench/facts";
import { live } from "../../motion/text.ja";
import { readable } from "../holder-name";

export const who = (name: string | undefined) => readable(name ?? "別のクライアント", live.motion.holder);
export const because = (p: Facts) => (p.reason ? `: ${p.reason.replace(/[。.\s]+$/, "")}。` : "。");

/** Reasons of a stop that the page sends. */
export const STOP_CAUSE: Readonly<Record<string, string>> = {
  stop_button: "停止ボタン",
  esc_key: "Escキー",
  space_key: "Spaceキー",
};

export const LEASE_END: Readonly<Record<string, (p: Facts) => string>> = {
  expired: p => `${who(p.holder)}の動作権が時間切れになりました。`,
  released: p => `${who(p.holder)}が動作権を返しました。`,
  page_closed: p => `${who(p.holder)}のページが閉じられました。`,
  job_ended: p => `${who(p.holder)}が終了しました。`,
  passed: p => `要求していた${who(p.holder)}に動作権が移ります。`,
  forced: p => `${who(p.holder)}が動作権を強制的に取りました${because(p)}`,
};

/** Units of a position, by code. */
export const UNIT: Readonly<Record<string, string>> = {
  hundred_degrees: "100度",
  radian: "ラジアン",
  degree: "度",
  tenth_degree: "0.1度",
};
