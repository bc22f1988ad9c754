/** Japanese names of the steps of jobs, and their evidence. tests/contract/test_japanese.py checks that they are complete. */
import type { Translated } from "../text/language";
import { words as changing } from "./changing.ja";
import type { words as english } from "./steps.en";

const saving = {
  silence: "書き込みと起動中の無通信",
  restart: "再起動",
  back: "バスに復帰",
  soft_start: "ソフトスタート終了",
};

/** What a restart does to the horn, by the code of its forecast. */
const HORN: Readonly<Record<string, string>> = {
  unknown_start: changing.horn.unknown_start,
  stays: changing.horn.stays,
  holds: changing.horn.holds,
  no_torque: changing.horn.no_torque,
  brake: changing.horn.brake,
  unknown: changing.horn.unknown,
};

const QUANTITIES: Readonly<Record<string, string>> = {
  inertia: "慣性",
  breakaway: "静止摩擦",
  coulomb: "動摩擦",
  viscous: "粘性摩擦",
  backlash_deg: "バックラッシ",
  torque_lag_s: "トルクの遅れ",
  load_pct: "負荷",
  supply_ohm: "電源の抵抗",
  deadband_deg: "デッドバンド",
  reversal_deg: "両側の差",
  repeatability_deg: "繰り返し精度",
  top_speed_rpm: "最高速度",
  stop_cw_deg: "右の停止位置",
  stop_ccw_deg: "左の停止位置",
};

const TORQUE: Readonly<Record<string, string>> = { on: "オン", off: "オフ", brake: "ブレーキ" };

export const words = {
  of: (servo, step) => `${servo}: ${step}`,
  steps: {
    save: {
      ...saving,
      check: "静止、電源、RAMの確認",
      snapshot: "スナップショットの作成",
      write: "ROMへの書き込み",
      read_back: "ROMの全行の読み返し",
    },
    restart: {
      ...saving,
      request: "再起動の要求",
      silence: "起動中の無通信",
      read_back: "全行の読み出し",
    },
    factory_reset: {
      check: "電源とRAMの確認",
      snapshot: "スナップショットの作成",
      torque_off: "トルクオフ",
      erase: "サーボ自身による初期化",
      read: "現在の値の読み出し",
      identity: "IDと原点の書き戻し",
      rows: "異なる行の書き込み",
      save: "ROMへの保存",
      verify: "全行の確認",
    },
    identify: {
      check: "ホーンの静止、トルク、制限の確認",
      limit: "速度とトルクの制限",
      wiggle: "ホーンの往復",
      return: "元の位置に復帰",
      restore: "すべての値の復元",
    },
    step_test: {
      check: "準備と測定条件の記録",
      measure: "ステップの往復",
      evaluate: "数値の計算と保存",
    },
    frequency_response: {
      check: "準備と測定条件の記録",
      measure: "応答の測定",
      evaluate: "応答の計算と保存",
    },
    mechanics: {
      check: "確認と測定条件の記録",
      deadband: "デッドバンドの測定",
      repeatability: "両側からの位置決め",
      speed: "速度の測定",
      friction: "摩擦、慣性、負荷の測定",
      travel: "範囲の低速往復",
      end_stops: "端の停止位置の探索",
      restore: "すべての値の復元",
      evaluate: "結果の保存",
    },
    improve: {
      check: "確認と制限値の書き込み",
      baseline: "今のゲインの測定",
      identify: "ホーンと負荷の同定",
      search: "モデル上でのゲインの探索",
      confirm: "新しいゲインの測定",
      finish: "ゲインの確定または復元と確認",
      improve: "改善",
    },
    profile: {
      plan: "値の確認",
      write: "書き込みと読み返し",
      save: "保存",
    },
    commissioning: {
      check: "計画との一致の確認",
      park_servo_id: "次のサーボのためにサーボIDを0に変更",
      park_node_id: "次のサーボのためにノードIDを動的割当てに変更して保存",
      identify: "ホーンの往復",
      write: "名前、ID、値の書き込みと読み返し",
      save: "保存",
      verify: "計画どおりであることの確認",
    },
    restore_output: { clear: "停止の解除", restore: "出力オン" },
    plan: {
      write: "プロファイルの書き込みと読み返し",
      check: "指令の確認",
      torque_on: "トルクオン",
      move: "移動",
      speed: "速度指令での回転",
      torque: "トルク指令",
      wait: "待機",
      torque_off: "トルクオフ",
    },
  },
  planned: {
    move: p => `${p.angle_deg}へ移動`,
    speed: p => `${p.rpm}で${p.for_s}回転`,
    torque: p => `トルク${p.torque_pct}を${p.for_s}`,
    wait: p => `${p.for_s}待機`,
  },
  numbered: (n, step) => `${n}. ${step}`,
  evidence: {
    problem: p => p.problem ?? "失敗しました。",
    interrupted: () => "ここでサーバが終了しました。サーボが実行したかどうかは不明です。",
    rows_read: p =>
      [
        `${p.rows}行を読み出し`,
        p.supply_v && `電源${p.supply_v}`,
        p.speed_rpm && `ホーンは${p.speed_rpm}で動いています`,
        p.horn && (p.horn === "moves" ? changing.horn.moves(p.from_deg ?? "") : HORN[p.horn]),
      ]
        .filter(Boolean)
        .join("、"),
    snapshot_taken: p => `スナップショット${p.snapshot}`,
    snapshot_known: p => `スナップショット${p.snapshot}は作成済み`,
    snapshot_failed: () => "スナップショットを保存できませんでした。今回の保存は元に戻せません。",
    sent: p =>
      `${p.tries}回送信。${p.acknowledged ? "サーボが応答しました" : "応答なし: 再起動で確認します"}`,
    requested: p => `${p.tries}回要求`,
    silent: p => `送信後${p.from_s}から${p.to_s}まで受信なし`,
    restarted: () => "稼働時間（uptime）が0に戻りました。",
    restarted_on_request: () => "自動では再起動せず、要求後に稼働時間（uptime）が0に戻りました。",
    back_on_node: p =>
      p.node_id === p.node_id_before
        ? `ノード${p.node_id}（変更なし）、送信後${p.after_s}で識別`
        : `ノード${p.node_id_before ?? "–"} → ${p.node_id ?? "–"}、送信後${p.after_s}で識別`,
    no_soft_start: () => "ソフトスタートなし: オフか、トルクオフで起動しました。",
    soft_start_over: p =>
      [`${p.took_s}で終了`, p.angle_deg && `ホーンは${p.angle_deg}`].filter(Boolean).join("、"),
    soft_start_aborted: () => "トルクがオフになったため終了",
    read_back: p => `${p.rows}行を読み返し、すべて保存どおり`,
    all_rows_read: p => `${p.rows}行を読み出し`,
    torque_off: () => "0x20はオフ",
    erased: p =>
      `${p.acknowledged ? "サーボが応答" : "応答なし: 値を読み出して確認"}、${
        p.restarted ? `再起動（ノード${p.node_id ?? "–"}）` : "再起動なし"
      }`,
    rows_differ: p =>
      `${p.rows}行がまだ異なります${p.torque_was_on ? "。トルクがオンに戻っていたため、オフにしました" : ""}`,
    nothing_differs: () => "すべて一致",
    rows_written: p => p.keys ?? "",
    saved_by_job: p => `ジョブ${p.job}で保存`,
    rows_verified: p => `再起動後にROMの${p.rows}行を読み返し、すべて一致`,
    at_rest: p =>
      `ホーンは${p.angle_deg}で静止、トルクは${TORQUE[p.torque ?? ""] ?? ""}${p.commanded ? "（指令中）" : ""}、可動範囲${p.low_deg}～${p.high_deg}`,
    not_limited: p =>
      `ファームウェア${p.firmware ?? "（不明）"}に0x25はないため、サーボ側の制限はなく、ゆっくりした指令だけで抑えます。`,
    limited: p => `速度${p.speed_rpm}、トルク${p.torque_pct}（0x25、0x3A～0x3D、RAMのみ、一時的）`,
    wiggled: p =>
      `${p.low_deg}～${p.high_deg}で動作（${p.readings}回の読み出し）、${p.angle_deg}から最大${p.most_deg}`,
    angle_unknown: () => "角度の応答がありませんでした。",
    returned: p => `${p.angle_deg}、元の位置から${p.away_deg}`,
    restored: p =>
      `全行を書き戻して確認、${
        p.torque === "on"
          ? `${p.commanded ? "指令を継続" : "位置を保持"}${p.timeout_s ? `（${p.timeout_s}後に通信タイムアウト0x26でトルクオフ）` : ""}`
          : `トルクは元どおり${TORQUE[p.torque ?? ""] ?? ""}`
      }`,
    test_conditions: p =>
      [`ホーンは${p.angle_deg}`, p.supply_v && `電源${p.supply_v}`, `整定範囲±${p.band_deg}`]
        .filter(Boolean)
        .join("、"),
    samples: p => `${p.steps}ステップ、${p.samples}サンプル、${p.rate_hz}`,
    response_conditions: p =>
      [`ホーンは${p.angle_deg}`, p.supply_v && `電源${p.supply_v}`, `振幅±${p.amplitude_deg}`]
        .filter(Boolean)
        .join("、"),
    response_measured: p => `${p.samples}サンプル、${p.rate_hz}、${p.slots}指令のうち${p.missed}指令が未送信`,
    response_stored: p =>
      p.from_hz === undefined
        ? `測定${p.run}、信頼できません`
        : `測定${p.run}、${p.from_hz}～${p.to_hz}で信頼できます`,
    mechanics_conditions: p =>
      [`ホーンは${p.angle_deg}`, p.supply_v && `電源${p.supply_v}`, `${p.from_deg}～${p.to_deg}で動作`]
        .filter(Boolean)
        .join("、"),
    mechanics_measured: p =>
      Object.entries(p)
        .map(([name, value]) => `${QUANTITIES[name] ?? name} ${value}`)
        .join("、") || "測定できた値はありません",
    travel_swept: p => `${p.points}か所で負荷と摩擦を測定、うち${p.binding}か所で引っかかりあり`,
    rows_restored: () => "全行を書き戻して確認しました",
    mechanics_stored: p => `測定${p.run}、${p.quantities}項目`,
    improve_conditions: p =>
      `ホーンは${p.angle_deg}、${p.from_deg}～${p.to_deg}の中で最大${p.step_deg}のステップ`,
    baseline_measured: p =>
      [
        p.hunts ? "ハンチングあり" : p.settling_s ? `整定${p.settling_s}` : "整定せず",
        `オーバーシュート${p.overshoot_pct}`,
      ].join("、"),
    horn_identified: p =>
      `慣性${p.inertia}、摩擦${p.friction_pct}、バックラッシ${p.backlash_deg}、負荷${p.load_pct}`,
    gains_found: p => `${p.tried}組を比較、予測: ${p.settling_s ? `整定${p.settling_s}` : "整定せず"}`,
    gains_measured: p =>
      [
        p.settling_s ? `整定${p.settling_s}` : "整定せず",
        `オーバーシュート${p.overshoot_pct}`,
        `${p.tried}組を試行`,
      ].join("、"),
    nothing_better: () => "モデル上でより良いゲインはありません",
    gains_kept: p => `P ${p.p_gain ?? "–"}に変更、${p.after_ms ? `整定${p.after_ms} ms` : "安定"}`,
    gains_restored: () => "元のゲインに戻し、確認しました",
    run_stored: p =>
      [
        `測定${p.run}`,
        p.rise_s && `立ち上がり${p.rise_s}`,
        p.overshoot_pct && `オーバーシュート${p.overshoot_pct}`,
        p.settling_s && `整定${p.settling_s}`,
      ]
        .filter(Boolean)
        .join("、"),
    planned: p => `${p.rows}行${p.left_out && p.left_out !== "0" ? `、${p.left_out}行は対象外` : ""}`,
    written: p => `${p.rows}行を書き込んで読み返し、${p.unchanged}行は変更なし`,
    saved: () => "ROMに保存し、再起動後に読み返しました。",
    save_not_needed: () => "不要: ROMはすでに同じ値です。",
    identified: p => `ノード${p.node_id ?? "–"}で動作し、元の位置に戻りました。`,
    values_verified: p =>
      `${p.in_rom ? "RAMとROM" : "RAMのみ"}の${p.values}件の値がすべて一致（ノード${p.node_id ?? "–"}から読み出し）`,
    values_still_verified: p =>
      `${p.values}件の値をすべて確認（ノード${p.node_id ?? "–"}から読み出し）、書き込みなし${
        p.verified_at ? "。ROMは前回の確認のとおり" : ""
      }`,
    servo_id_parked: p => `サーボID ${p.servo_id ?? "–"}が空きました。`,
    servo_id_restored: p => `サーボID ${p.servo_id ?? "–"}に戻しました。`,
    servo_id_lost: p => `サーボIDはRAMで0です: ${p.servo_id ?? "–"}に戻せませんでした。`,
    node_id_parked: p => `ノードID ${p.node_id_before ?? "–"}が空きました。今は${p.node_id ?? "–"}です。`,
    failed_before: () => "前の手順が失敗しました。",
    job_ended: () => "異常のため処理を終了しました。",
    values_refused: () => "このサーボには書き込めない値があります。",
    other_refused: p => `何も書き込んでいません: ${p.servo}に書き込めない値があります。`,
    other_failed: p => `${p.servo}が指示どおりになりませんでした。`,
    latch_cleared: () => "停止状態でした。",
    not_latched: () => "停止状態ではありませんでした。",
    held: p =>
      `${p.angle_deg ?? "–"}で保持。${p.held_by === "lease" ? "指令中: 動作権が終わるとオフ" : "自力で保持"}`,
    plan_checked: p => `すべての指令を確認。オンの故障ビット${p.faults}件`,
    plan_step: p =>
      [
        `${p.runs}回中${p.within}回が制限内`,
        p.error_deg && `最大誤差${p.error_deg}`,
        p.mean_s && `整定の平均${p.mean_s}、最大${p.most_s}`,
      ]
        .filter(Boolean)
        .join("、"),
    torque_off_pending: () => "応答がまだありません。応答があるまで繰り返します。",
  },
} satisfies Translated<typeof english>;
