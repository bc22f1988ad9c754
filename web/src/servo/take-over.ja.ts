/** Japanese words of requesting or taking motion control from another holder; loaded with them. */
import type { Translated } from "../text/language";
import type { words as english } from "./take-over.en";

const seconds = (left: number) => `${Math.max(0, Math.ceil(left))}\u202fs`;

export const words = {
  held: holder => `${holder}が動作権を持っています`,
  left: left =>
    `相手の最後の通信から${seconds(left)}で失効します。相手が作業中であれば、動作権を要求してください。`,
  why: "理由（相手に表示されます）",
  request: "動作権を要求",
  take: "直ちに取得…",
  requested: holder => `${holder}に動作権を要求しました`,
  passes: left => `拒否されなければ${seconds(left)}後に移ります。`,
  withdraw: "要求の取り消し",
  refused: holder => `${holder}が動作権の引き渡しを拒否しました。`,
  over: "要求は終了しました。もう一度要求してください。",
  takeTitle: holder => `${holder}から動作権を取得しますか？`,
  takeText: holder =>
    `${holder}が指令している全サーボのトルクがオフになります。負荷が落ちることがあり、相手の作業は直ちに中断されます。`,
  takeWhy: "理由",
  takeNeeds: "理由を入力してください。監査記録に残り、相手にも表示されます。",
  takeNow: "直ちに取得",
  yours: "動作権を取得しました",
  yoursText: "それまで指令されていたサーボのトルクはオフです。動作を有効にするまで何も動きません。",
  release: "動作権を解放",
} satisfies Translated<typeof english>;
