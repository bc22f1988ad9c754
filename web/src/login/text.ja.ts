/** Japanese words of signing in and out; loaded with them. */
import type { Translated } from "../text/language";
import type { words as english } from "./text.en";

export const words = {
  title: "hornbillにサインイン",
  why: "このサーバはサーボを動かすため、トークンが必要です。",
  token: "トークン",
  enter: "サインイン",
  unknown: "無効なトークンです。失効したか、一部しかコピーされていない可能性があります。",
  tooMany: wait_s => `サインインの失敗が続いています。${wait_s}\u202fs後に再試行してください。`,
  stop: "停止は今も送信されます。サーバが受け付けるのは、以前サインインしたブラウザと、サーバのコンピュータ自身からの停止です。それ以外の場合は電源を切ってください。",
  how: "サーバの管理者は次のコマンドでトークンを作れます:",
  as: (name, role) => `${name}、${role}`,
  roles: {
    view: "閲覧と停止",
    operate: "サーボの動作",
    configure: "サーボの設定",
    admin: "すべての操作",
  },
  leave: "サインアウト",
} satisfies Translated<typeof english>;
