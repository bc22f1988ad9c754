/** The frame: what stands round every page, and which page is inside. */
import { useSignal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import { MissingPage, MissingServo } from "./pages/missing";
import { MotionPage } from "./pages/motion";
import { ServosPage } from "./pages/servos";
import { connectOpen } from "./state/connect";
import { openDrift } from "./state/drift";
import { servo } from "./state/fleet";
import { onKey } from "./state/keys";
import { link } from "./state/link";
import { route } from "./state/route";
import { signedOut } from "./state/session";
import { Bands } from "./ui/bands";
import { TopBar } from "./ui/bar";
import { Foot } from "./ui/foot";
import { lazy } from "./ui/lazy";
import { Panel } from "./ui/panel";
import { Rail, SkipLink } from "./ui/rail";

const ApiPage = lazy(() => import("./pages/api").then(file => file.ApiPage));
const BusPage = lazy<{ hash: string }>(() => import("./pages/bus").then(file => file.BusPage));
const CommissionPage = lazy(() => import("./pages/commission").then(file => file.CommissionPage));
const FaultsPage = lazy<{ uid: string | null }>(() => import("./pages/faults").then(file => file.FaultsPage));
const KeysHelp = lazy<{ onClose: () => void }>(() => import("./ui/keys-help").then(file => file.KeysHelp));
const LoginPage = lazy(() => import("./pages/login").then(file => file.LoginPage));
const MatrixPage = lazy<{ hash: string }>(() => import("./pages/matrix").then(file => file.MatrixPage));
const ParametersPage = lazy<{ uid: string; hash: string }>(() =>
  import("./pages/parameters").then(file => file.ParametersPage),
);
const RecordsPage = lazy<{ hash: string }>(() => import("./pages/records").then(file => file.RecordsPage));
const TunePage = lazy<{ uid: string | null }>(() => import("./pages/tune").then(file => file.TunePage));
const DriftDialog = lazy(() => import("./pages/drift-dialog").then(file => file.DriftDialog));
const ConnectDialog = lazy(() => import("./pages/bus-connect").then(file => file.ConnectDialog));

export function App() {
  const help = useSignal(false);
  useEffect(() => {
    const open = () => {
      help.value = true;
    };
    return onKey("?", open);
  }, [help]);
  return (
    <div class="frame" data-link={link.value.state}>
      <SkipLink />
      <TopBar />
      <Panel>
        <Bands />
      </Panel>
      <Panel>
        <Rail
          onKeys={() => {
            help.value = true;
          }}
        />
      </Panel>
      <main tabIndex={-1}>
        {/* Another page begins anew, whatever became of the one before. */}
        <Panel key={`${route.value.page}/${route.value.uid}`}>
          {signedOut.value ? <LoginPage /> : <Page />}
        </Panel>
      </main>
      <Panel>
        <Foot />
      </Panel>
      {connectOpen.value && (
        <Panel>
          <ConnectDialog />
        </Panel>
      )}
      {openDrift.value !== null && (
        <Panel>
          <DriftDialog />
        </Panel>
      )}
      {help.value && (
        <KeysHelp
          onClose={() => {
            help.value = false;
          }}
        />
      )}
    </div>
  );
}

function Page() {
  const { page, uid, hash } = route.value;
  if (uid !== null && servo(uid) === undefined) return <MissingServo uid={uid} />;
  if (page === "parameters" && uid) return <ParametersPage key={uid} uid={uid} hash={hash} />;
  if (page === "matrix") return <MatrixPage hash={hash} />;
  if (page === "motion" && uid) return <MotionPage key={uid} uid={uid} />;
  if (page === "tune") return <TunePage uid={uid} />;
  if (page === "faults") return <FaultsPage uid={uid} />;
  if (page === "bus") return <BusPage hash={hash} />;
  if (page === "commission") return <CommissionPage />;
  if (page === "api") return <ApiPage />;
  if (page === "records") return <RecordsPage hash={hash} />;
  if (page === "missing") return <MissingPage />;
  return <ServosPage />;
}
