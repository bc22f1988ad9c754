/** The Japanese sentences of the frame: rail, top bar, Stop, bands, events. */
import type { Text } from "../text/language";

export const frame = {
  serverFailure: {
    database: "変更が保存されていません。hornbillを再起動すると失われます。",
    disk_space: "データフォルダのディスクに空きがありません。変更と記録を保存できません。",
    computer_busy: "hornbillのコンピュータが過負荷です。サーボの応答遅れや途絶は見かけだけの場合があります。",
  },
  nav: {
    servos: "サーボ",
    commission: "初期設定",
    overview: "概要",
    matrix: "マトリクス",
    parameters: "パラメータ",
    motion: "動作",
    tune: "調整",
    scope: "スコープ",
    site: "サイト",
    silent: "通信なし",
    faults: "異常",
    unseen: "未確認",
    bus: "バス",
    recorder: "レコーダ",
    records: "記録",
    api: "API",
    more: "その他",
    label: "ページ",
    on: "オン",
    stopped: "停止中",
  },
  theme: { label: "配色", light: "明", dark: "暗", auto: "自動" },
  language: "言語",
  skip: "本文へ移動",
  bar: {
    bus: address => `バス ${address}`.trim(),
    role: { host: "ホスト", guest: "ゲスト", observer: "オブザーバ" },
    busLoad: (address, load) => `バス ${address}、負荷 ${load}`,
    busState: {
      disconnected: "未接続",
      connecting: "接続中",
      active: "アクティブ",
      passive: "エラーパッシブ",
      bus_off: "バスオフ",
      lost: "アダプタ喪失",
    },
    over: "再生終了",
    nothing: "受信なし",
    bitrate: mbit => `${mbit}\u202fMbit/s`,
    retry: (word, s) => `${word}、${s}\u202fs後に再試行`,
    load: pct => `負荷 ${pct}`,
    loadLimit: (pct, cap) => `負荷 ${pct}、上限 ${cap}`,
    loadUnknown: "負荷不明",
    servos: "サーボ",
    noServos: "なし",
    motion: "動作権",
    free: "なし",
    you: "自分",
    elsewhere: (nodes, n, you, short) => `ノード${nodes}: ${n}${short ? "" : "台"}、あなた: ${you}`,
    youFor: name => `自分、${name}`,
    share: (holder, n, short) => `${holder}: ${n}${short ? "" : "台"}`,
    held: (holder, left) => `${holder}、残り${left}\u202fs`,
    motionLeft: left => `動作権、残り${left}\u202fs`,
    requested: (by, left) => `${by}が要求中、${left}\u202fs`,
    refused: "停止中は不可",
  },
  link: {
    lost: s =>
      `hornbillとの接続が${s}\u202fs途切れています。表示値は古く、操作は無効です。自動で再接続します。`,
    up: "hornbillに接続中",
    down: "hornbillに未接続",
  },
  request: {
    label: "動作権の要求",
    wants: (by, reason) =>
      `${by}が動作権を要求しています${reason ? `: ${reason.replace(/[。.\s]+$/, "")}。` : "。"}`,
    passes: left => `維持しなければ${left}\u202fs後に移ります。先にトルクがオフになります。`,
    keep: "動作権を維持",
    handOver: "引き渡し",
    handedOver: by => `動作を終了: ${by}に引き渡しました。トルクはオフです。`,
  },
  stop: {
    word: "停止",
    keys: { on: "EscまたはSpace", moving: "Esc", still: "Escを2回", again: "もう一度Esc" },
    reach: n => `全${n}台を直ちに停止`,
    stopped: "停止中",
    again: "押すと再送信",
    noLink: "接続なし",
    cut: "電源を切断",
    label: "停止: 全サーボのトルクをオフ",
    unsent: why => `停止がhornbillに届きませんでした。電源を切ってください。${why}`,
    sendsNothing: "何も送信しません",
    benchOnly: bench => `${bench}のみ`,
    reaches: (n, all) => `${n}/${all}台に届く、Esc`,
    headline: (at, by, done, all, mode, reach = "all") => {
      const what =
        all === 0
          ? ({
              none: "オブザーバなので何も送信していません。",
              own: "hornbillが指令中のサーボはありませんでした。",
            }[reach] ?? "既知のサーボはありません。")
          : done === all && all > 1
            ? `全${all}台のトルクは${mode}です。`
            : done === 0
              ? `${all}台からまだ応答がありません。`
              : all === 1
                ? `サーボのトルクは${mode}です。`
                : `${all}台中${done}台のトルクは${mode}です。`;
      return `${at}${by}停止。${what}`;
    },
    by: who => `、${who}により`,
    node: id => `ノード${id}`,
    you: "自分",
    silent: names => `${names}が応答しません。動く可能性があれば電源を切ってください。`,
    silentMany: names => `${names}が応答しません。動く可能性があれば電源を切ってください。`,
    stays: "停止を解除するまで動作はできません。解除しても何も動きません。",
    first: "最初の応答まで",
    last: "最後の応答まで",
    repeating: names => `${names}へ再送信中`,
    happened: "状況を表示",
    clear: "停止を解除…",
    clearTitle: "停止を解除しますか？",
    clearText: "解除しても何も動きません。トルクをオンにするまで、全サーボのトルクはオフのままです。",
    unsentPast: "停止がhornbillに届かなかったことがあります。必要ならもう一度停止を押してください。",
    clearSilent: names => `${names}のトルクオフは未確認です。`,
    clearConfirm: "停止を解除",
    brake: "ブレーキ",
    off: "オフ",
    confirmed: ms => `トルクオフを${ms}で確認`,
    noResponse: "停止に応答なし",
  },
  panel: {
    failed: why => `ページのこの部分で問題が起きました: ${why}。他の部分は動いています。`,
    again: "再試行",
  },
  missing: {
    page: "このアドレスにページはありません",
    pageLine: "アドレスを確認するか、サーボの一覧から始めてください。",
    servo: "不明なサーボ",
    uid: "固有ID",
    servoLine:
      "この固有IDのサーボは、このサーバでは検出されていません。アドレスを確認するか、サーボを選んでください。",
  },
  lazy: {
    link: "ページのこの部分はまだ読み込まれていません。hornbillに接続できません。接続が戻ると表示されます。",
    updated: "このページを開いた後にhornbillが更新されました。続けるにはページを再読み込みしてください。",
    refused: "ページのこの部分を読み込めませんでした。サーバから届きません。再試行しています。",
    reload: "再読み込み",
  },
  events: {
    title: "イベント",
    all: n => `全${n}件のイベント`,
    none: "ページを開いてからイベントはありません。",
    hide: "イベントを非表示",
  },
  keys: "キー操作",
} satisfies Partial<Text>;
