/** Japanese words of changes to servos: the dialog before a change, its progress and result; loaded with them. */
import type { Translated } from "../text/language";
import type { words as english } from "./changing.en";

const NOTHING_SAVED = "ROMの値はすべて同じです。それでもサーボは保存して再起動します。";

export const words: Translated<typeof english> = {
  kinds: {
    apply: {
      title: ({ name }) => `${name}の変更の確認`,
      lead: "まだ何も書き込んでいません。",
      go: ({ values: n }) => `このまま${n}件の値を書き込み`,
    },
    save: {
      title: ({ name, values: n }) =>
        n === 0 ? `${name}をROMに保存しますか？` : `${name}の${n}件の値をROMに保存しますか？`,
      nothing: NOTHING_SAVED,
      go: ({ name }) => `保存して${name}を再起動`,
      running: ({ name }) => `${name}をROMに保存中`,
      done: ({ name }) => `${name}をROMに保存しました`,
      failed: ({ name }) => `${name}は保存できませんでした`,
    },
    undo: {
      title: ({ name, values: n }) => `${name}の${n}件の値を復元しますか？`,
      lead: "以前RAMにあった値です。RAMに書き込んで読み返します。ROMは変わりません。",
      head: { now: "現在", next: "以前" },
      go: ({ values: n }) => `${n}件の値を復元`,
    },
    snapshot: {
      title: ({ name }) => `${name}を復元`,
      nothing: "変更はありません。既にすべて同じ値です。",
      save: "ROMにも保存。再起動し、約1秒間トルクがなく、ホーンがゆっくり0°へ動くことがあります",
      ram: "RAMのみ: 電源を切ると消えます。",
      go: ({ values: n, save }) => `${n}件の値を書き込み${save ? "、保存" : ""}`,
    },
    drift: {
      title: ({ name }) => `${name}は別のツールで変更されました`,
      lead: "ROMの値が、hornbillが前回読み出した値と異なります。別のコンピュータまたはツールが書き込みました。",
      head: { now: "検出した値", next: "以前の値" },
      nothing: "違いはなくなりました。",
      save: "ROMに保存: 再起動し、約1秒間トルクがなく、ホーンがゆっくり0°へ動くことがあります",
      ram: "RAMのみ: ROMの値を確認できるまで印は残ります。",
      go: ({ values: n }) => `${n}件の値を復元`,
      other: "検出した値を採用",
    },
    batch: {
      title: ({ servos: n }) => `${n}台のサーボに適用しますか？`,
      save: "ROMにも保存: 各サーボが再起動します",
      ram: "RAMのみ: 再起動しません。電源を切ると消えます。",
      go: ({ servos: n, save }) => `${n}台のサーボに適用${save ? "して保存" : ""}`,
      running: ({ servos: n }) => `${n}台のサーボに適用中`,
      done: ({ servos: n }) => `${n}台のサーボに適用しました`,
      failed: ({ servos: n }) => `${n}台のサーボには適用できませんでした`,
    },
    "batch-save": {
      title: ({ servos: n }) => `${n}台のサーボをROMに保存しますか？`,
      nothing: NOTHING_SAVED,
      go: ({ servos: n }) => `${n}台のサーボを保存して再起動`,
      running: ({ servos: n }) => `${n}台のサーボをROMに保存中`,
      done: ({ servos: n }) => `${n}台のサーボを保存しました`,
      failed: ({ servos: n }) => `${n}台のサーボは保存できませんでした`,
    },
    profile: {
      title: ({ name }) => `${name}を適用`,
      save: "ROMに保存。各サーボが再起動し、約1秒間トルクがなく、ホーンがゆっくり0°へ動くことがあります",
      go: ({ servos: n }) => `${n}台に適用`,
      running: ({ name }) => `${name}を適用中`,
      done: ({ name }) => `${name}を適用しました`,
      failed: ({ name }) => `${name}を一部のサーボに適用できませんでした`,
    },
    restart: {
      title: ({ name, servos: n }) =>
        n === 1 ? `${name}を再起動しますか？` : `${n}台のサーボを再起動しますか？`,
      head: { now: "今のRAM", next: "再起動後（ROM）" },
      nothing: "失われる値はありません。RAMの値は確認済みのROMの値と同じです。",
      go: ({ name, servos: n }) => (n === 1 ? `${name}を再起動` : `${n}台を再起動`),
      running: ({ name, servos: n }) => (n === 1 ? `${name}を再起動中` : `${n}台を再起動中`),
      done: ({ name, servos: n }) => (n === 1 ? `${name}を再起動しました` : `${n}台を再起動しました`),
      failed: ({ name, servos: n }) =>
        n === 1 ? `${name}の再起動を確認できません` : `${n}台は再起動していません`,
    },
    "factory-reset": {
      title: ({ name }) => `${name}を初期化しますか？`,
      head: { now: "現在", next: "初期値" },
      nothing: "すべて初期値ですが、書き込んで再起動します。",
      go: ({ name }) => `${name}を初期化`,
      running: ({ name }) => `${name}を初期化中`,
      done: ({ name }) => `${name}を初期化しました`,
      failed: ({ name }) => `${name}は初期化できませんでした`,
    },
    output: {
      title: ({ servos: n }) => `${n}台の出力を復帰しますか？`,
      go: () => "出力を復帰",
      running: () => "出力を復帰中",
      done: ({ servos: n }) => `${n}台の出力がオンになりました`,
      failed: () => "一部の出力を復帰できませんでした",
    },
  },
  parameter: "パラメータ",
  now: "現在",
  next: "新しい値",
  planning: "変更内容を確認中",
  again: "再確認",
  preview: "変更内容を表示",
  nothing: "変更はありません。",
  unchanged: n => `${n}件は既に同じ値です。`,
  leftOut: n => `${n}件を省略`,
  rejected: why => `除外、何も書き込みません: ${why}`,
  refused: why => `何も書き込んでいません。${why}`,
  facts: (model, serial, id) => `${model}、${serial}、サーボ${id}`,
  keepOn: "終わるまで電源を切らないでください。",
  inTurn: "この順に1台ずつ再起動します。最後の1台が終わるまで、このページを開いておいてください。",
  lost: n => `RAMのみの${n}件の値が失われます`,
  lostHint: "残すには、キャンセルして先にROMに保存してください。",
  assumed: "検出されなかった再起動の後にRAMで検出",
  working: "書き込み中",
  show: "進行状況を表示",
  of: (done, all) => `${done} / ${all}台完了`,
  steps: name => `${name}の手順`,
  results: "各サーボの結果",
  state: {
    waiting: "待機中",
    running: "実行中",
    done: "完了",
    failed: "失敗",
    left_out: "未開始",
  },
  written: n => `${n}件の値を書き込み、読み返しました`,
  writtenSaved: n => `${n}件の値を書き込んで保存し、ROMから読み返しました`,
  saved: "保存し、ROMから読み返しました",
  fault: {
    not_written: why => `書き込めません: ${why}`,
    rolled_back: why => `書き込めず、このサーボは元のままです。${why}`,
    not_saved: why => `RAMに書き込みましたが、保存できません。${why}`,
  },
  gap: {
    save: "ROMに書き込んで再起動します。約1秒間トルクがなく、負荷が落ちることがあります。",
    restart: "約1秒間トルクがなく、負荷が落ちることがあります。",
    "factory-reset": "まずトルクをオフにします。数秒間トルクがなく、負荷が落ちることがあります。",
  },
  horn: {
    moves: from => `ホーンが動きます: ${from}から0.0°へ`,
    unknown_start: "ホーンが0.0°へ動きます",
    stays: "ホーンは0.0°のままです",
    holds: "ホーンは動きません",
    no_torque: "サーボはトルクオフで再起動します",
    brake: "サーボはブレーキで再起動します",
    unknown: "ホーンが0.0°へ動くことがあります",
  },
  after: {
    moves: "その後、最大30\u202frpm、トルク30\u202f%でゆっくり0.0°へ動きます。",
    unknown_start:
      "その後、ゆっくり0.0°へ動きます。再起動で原点または回転方向が変わるため、始めの角度は不明です。",
    stays: "その後、0.0°から1°以内で保持します。",
    holds: "ソフトスタートはオフのため、その後は今の位置を保持します。",
    no_torque: "再起動後、トルクをオンにするまで何も保持しません。",
    brake: "再起動後は弱いブレーキだけで、角度を保持しません。",
    unknown: "ROMをすべて読み出していないため、その後のホーンの動きは不明です。",
  },
  warnings: {
    turn_count_lost: (before, after) =>
      `回転数が失われます: ${before}は${after}になります。次の動作は逆向きになることがあります。`,
    rom_lost: () =>
      "前回の起動で保存値を読み込めませんでした。今回も読み込めなければ、再び初期値で動きます。スナップショットを復元して保存してください。",
    timeout_during_soft_start: after =>
      `起動から${after}で通信タイムアウト（0x26、0x27）により出力がオフになり、ホーンが惰性で動くことがあります。`,
    energised: () =>
      "ROMの書き込み直前に出力が一瞬オンになり、ホーンを今の位置で保持します。手を触れないでください。",
    outside_limits: (here, limit) =>
      `ホーンは${here}にあり、動作制限角度の範囲外です。${limit}まで動くことがあります。`,
    supply_near_limit: (supply, limit) =>
      `電源電圧は${supply}で、制限の${limit}に近い値です。ROMの書き込み中に下がらないようにしてください。`,
    supply_unknown: () => "電源電圧を読み出していません。ROMの書き込み中は安定した電源が必要です。",
    supply_beyond_limit: supply =>
      `電源電圧は${supply}で、再起動後の制限を外れます。その場合、出力はオフのままです。`,
  },
  reset: {
    keep: (id, node, origin) => `サーボID ${id}、${node}、原点 ${origin}を維持`,
    node: id => `ノードID ${id}`,
    dynamicNode: "動的ノードID",
    identityGoes:
      "サーボIDは0、ノードIDは動的になり、原点も変わることがあります。サーボは固有IDで再び見つかります。",
    changes: n => `RAMとROMの${n}件の値が変わります`,
    snapshot: "先に現在の値のスナップショットを取ります。",
    type: name => `確認のため「${name}」と入力`,
  },
  profile: {
    who: "対象のサーボ",
    none: "バスにサーボがありません。",
    goOn: "失敗しても残りを続行",
    planned: n => (n === 0 ? "既にすべて同じ値" : `${n}件を変更`),
  },
  output: {
    lead: "1台ずつ順に出力をオンにします。各ホーンは今の位置で保持されます。",
    clears: "停止を解除します。",
    load: "負荷あり",
    loaded: names => `負荷あり: ${names}。出力がオンになると、ホーンに負荷がかかります。`,
    torque: pct => `トルク約${pct}`,
    stays: why => `復帰しません。${why}`,
    keeps:
      "サーボの通信タイムアウト（0x26）で出力が再びオフになるため、このページが動作権を取得します。このページを離れる、タブを隠す、または動作を終了すると、出力はオフになります。",
    again: "停止がもう一度押されました。閉じて確認してから出力を復帰してください。",
    cleared: "停止を解除",
    held: deg => `${deg}で保持`,
    stop: "停止で直ちに終了します。",
  },
  profiles: {
    title: n => `${n}台にプロファイルを適用`,
    facts: (model, n) => `${model}、${n}項目`,
    toProfiles: "プロファイルへ",
    loading: "プロファイルを読み込み中です。",
    empty: "プロファイルはまだありません",
    emptyLine:
      "1台を設定し、そのサーボからプロファイルを作成してください。サーボの値が入り、IDと原点は含みません。TOMLまたはJSONファイルの読み込みもできます。",
    anyModel: "全機種",
  },
  report: {
    csv: "CSV",
    json: "JSON",
    junit: "JUnit",
    html: "印刷",
  },
};
