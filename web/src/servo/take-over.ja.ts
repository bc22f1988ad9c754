/** The Japanese sentences of getting motion control from somebody else; loaded with them. */
import type { Said } from "../text/language";
import type { words as english } from "./take-over.en";

const seconds = (left: number) => `${Math.max(0, Math.ceil(left))}\u202fs`;

export const words = {
  held: holder => `${holder}が動作権を持っています`,
  left: left => `最後の応答から${seconds(left)}で終わります。作業中であれば要求してください。`,
  why: "理由（相手に表示されます）",
  request: "要求",
  take: "すぐに取る…",
  requested: holder => `${holder}に動作権を要求しました`,
  passes: left => `拒否されなければ${seconds(left)}後に移ります。`,
  withdraw: "要求を取り下げる",
  refused: holder => `${holder}は動作権を渡しません。`,
  over: "要求は終わりました。もう一度要求してください。",
  takeTitle: holder => `${holder}から動作権を取りますか？`,
  takeText: holder =>
    `${holder}が指令している全サーボのトルクがオフになります。負荷が落ちることがあり、相手の作業はすぐに終わります。`,
  takeWhy: "理由",
  takeNeeds: "理由を入力してください。監査記録に残り、相手にも表示されます。",
  takeNow: "すぐに取る",
  yours: "動作権を取得しました",
  yoursText: "それまで指令されていたサーボのトルクはオフです。動作を有効にするまで何も動きません。",
  release: "解放",
} satisfies Said<typeof english>;
