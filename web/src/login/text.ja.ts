/** The Japanese sentences of signing in and out; loaded with them. */
import type { Said } from "../text/language";
import type { words as english } from "./text.en";

export const words = {
  title: "hornbillにサインイン",
  why: "このサーバーはサーボを動かすため、利用者の確認が必要です。",
  token: "トークン",
  enter: "サインイン",
  unknown: "一致するトークンがありません。失効したか、全体がコピーされていない可能性があります。",
  tooMany: wait_s => `失敗が多すぎます。${wait_s}\u202fs後に再試行してください。`,
  stop: "停止を押すと、今も送信されます。有効なのは、ここで以前サインインした人と、hornbillが動いているコンピューター自身からの停止です。それ以外では電源を切ってください。",
  how: "サーバーの管理者は次のコマンドでトークンを作れます:",
  as: (name, role) => `${name}、${role}`,
  roles: {
    view: "閲覧と停止",
    operate: "サーボの動作",
    configure: "サーボの設定",
    admin: "すべての操作",
  },
  leave: "サインアウト",
} satisfies Said<typeof english>;
