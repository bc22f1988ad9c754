/** The Japanese headings of groups in the list. */
import type { Translated } from "../text/language";
import type { words as english } from "./groups.en";

export const words = {
  rest: "その他",
  ok: "正常",
  notice: "通知",
  warning: "警告",
  protected: "保護動作",
  failure: "障害",
  busy: "処理中",
  identifying: "識別中",
  offline: "オフライン",
} satisfies Translated<typeof english>;
