/** Owns the frame: what stands round every page, and which page is inside. */
import { useSignal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import { MotionPage } from "./pages/motion";
import { ParametersPage } from "./pages/parameters";
import { ServosPage } from "./pages/servos";
import { connectOpen } from "./state/connect";
import { openDrift } from "./state/drift";
import { onKey } from "./state/keys";
import { link } from "./state/link";
import { route } from "./state/route";
import { Bands } from "./ui/bands";
import { TopBar } from "./ui/bar";
import { Foot } from "./ui/foot";
import { KeysHelp } from "./ui/keys-help";
import { lazy } from "./ui/lazy";
import { Rail } from "./ui/rail";

const BusPage = lazy<{ hash: string }>(() => import("./pages/bus").then(file => file.BusPage));
const CommissionPage = lazy(() => import("./pages/commission").then(file => file.CommissionPage));
const FaultsPage = lazy<{ uid: string | null }>(() => import("./pages/faults").then(file => file.FaultsPage));
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
      <TopBar />
      <Bands />
      <Rail
        onKeys={() => {
          help.value = true;
        }}
      />
      <main>
        <Page />
      </main>
      <Foot />
      {connectOpen.value && <ConnectDialog />}
      {openDrift.value !== null && <DriftDialog />}
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
  if (page === "parameters" && uid) return <ParametersPage key={uid} uid={uid} hash={hash} />;
  if (page === "motion" && uid) return <MotionPage key={uid} uid={uid} />;
  if (page === "tune") return <TunePage uid={uid} />;
  if (page === "faults") return <FaultsPage uid={uid} />;
  if (page === "bus") return <BusPage hash={hash} />;
  if (page === "commission") return <CommissionPage />;
  if (page === "records") return <RecordsPage hash={hash} />;
  return <ServosPage />;
}
