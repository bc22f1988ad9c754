/** Japanese text of the live panel and the Motion page. */
import type { Text } from "../text/language";

const seconds = (n: unknown) => Math.max(1, Math.ceil(Number(n)));

export const live = {
  motion: {
    holder: n => `ページ${n}`,
    off: name => `${name}の動作はオフです`,
    enable: name => `${name}の動作を有効にする`,
    what: "このページが動作権を取得し、トルクをオンにします。ホーンは現在の位置を保持し、指令するまで何も動きません。",
    ends: "このページを離れる、タブを隠す、接続が切れる、のいずれかで動作は終了し、3\u202fs以内にトルクがオフになります。",
    clear: "先に、ホーンが自由に回り、近くに人がいないことを確認してください。",
    requesting: "動作権を取得中",
    heldBy: (holder, left) =>
      `${holder}が動作権を持っています（あと${seconds(left)}\u202fs）。要求するか、待ってください。`,
    whileStopped: "停止中です。先に左上で停止を解除してください。",
    whileObserving: "オブザーバ: hornbillは何も送信しません。先に役割を変えてください。",
    whileCommanded: (name, node) => `${name}はノード${node}が指令しています。先にその指令を止めてください。`,
    whileOffline: name => `${name}はオフラインです。電源を確認してください。`,
    whileProtected: name => `${name}は保護動作中です: 出力はオフで、自動で復帰します。`,
    whileUnknown: name => `${name}のシリーズには対応していないため、動かしません。`,
    whileBusy: name => `${name}は処理中です。準備ができるまで待ってください。`,
    bandAll: names => `${names}の動作が有効です。`,
    dialText: (command, angle) => `指令 ${command}、ホーン ${angle}`,
    band: name => `${name}だけ動作が有効です。`,
    bandText:
      "このページを離れる、タブを隠す、接続が切れる、のいずれかで終わり、3\u202fs以内にトルクがオフになります。",
    turnOff: "動作を終了",
    dial: "角度指令、ドラッグで動きます",
    pastLimit: {
      angle_limit_cw: (value, limit, row) => `${value}は角度制限 CW ${limit}（${row}）を超えています。`,
      angle_limit_ccw: (value, limit, row) => `${value}は角度制限 CCW ${limit}（${row}）を超えています。`,
    },
    outside: from => `ホーンは${from}で制限の外です。最初の指令で、近い方の制限またはその内側へ動きます。`,
    endedByStop: "動作を終了しました: 停止。",
    stopHidden:
      "停止ボタンの全体がウィンドウに表示されていません。ウィンドウを広げるか表示を縮小してから、動作を有効にしてください。",
    endedByHiddenStop: "動作を終了しました: 停止ボタンの全体が表示されなくなりました。",
    endedByLink: "動作を終了しました: hornbillとの接続が切れました。トルクは自動でオフになります。",
    endedByHiding: "動作を終了しました: タブが隠れました。",
    notEnabled: "動作は有効になりませんでした。",
    endedByOther: holder => `動作を終了しました: ${holder}が動作権を取得しました。`,
    endedLease: "動作を終了しました: 動作権を失いました。",
    torqueOff: names => `トルクはオフです: ${names}。`,
    torqueNotConfirmed: names =>
      `応答なし: ${names}。トルクがオフかどうか不明です。hornbillは応答があるまでトルクオフを送信し続けます。ホーンが動いてはならない場合は電源を切ってください。`,
  },
} satisfies Partial<Text>;
