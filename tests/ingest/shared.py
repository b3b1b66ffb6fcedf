"""The real files that tests read, listed by name because their folder may contain others."""

from __future__ import annotations

#: Real files of the shared folder `formats`, and the format that claims each.
CLAIMED = {
    "afad/20170720223109_0921.txt": "afad",
    "cosmos/NP1795-n.305.v0c": "cosmos",
    "cosmos/us1000hyfh_akbmrp_AKBMR--n.1000hyfh.BNZ.--.acc.V2c": "cosmos",
    "csmip/CE89146.V1": "csmip_v1",
    "csmip/CE89146.V2": "csmip_v2",
    "csmip/CE89146.V3": "csmip_v2",
    "csmip/ce36456p_CE36456.V2": "csmip_v2",
    "csmip/chan001.v2": "csmip_v2",
    "esm/HI.ARS1..HNE.D.20190728.160908.C.ACC.ASC": "esm_dyna",
    "esm/HI.ARS1..HNN.D.20190728.160908.C.ACC.ASC": "esm_dyna",
    "esm/HI.ARS1..HNZ.D.20190728.160908.C.ACC.ASC": "esm_dyna",
    "geonet/20180212_211557_WPWS_20.V2A": "geonet",
    "knet/AOM0170806140843.EW": "knet",
    "knet/AOM0170806140843.NS": "knet",
    "knet/AOM0170806140843.UD": "knet",
    "knet/NGNH311106302345.EW1": "knet",
    "knet/NGNH311106302345.EW2": "knet",
    "miniseed/CI.CLC..HNE.mseed": "miniseed",
    "miniseed/CI.CLC..HNN.mseed": "miniseed",
    "miniseed/CI.CLC..HNZ.mseed": "miniseed",
    "peer_at2/A-BPL160.AT2": "peer_at2",
    "peer_at2/IMPVALL_E04-140_example1.AT2": "peer_at2",
    "peer_at2/NIS090.AT2": "peer_at2",
    "peer_at2/RSN1_HELENA.A_A-HMC180.AT2": "peer_at2",
    "peer_at2/RSN77_SFERN_PUL164.AT2": "peer_at2",
    "peer_at2/RSN88_SFERN_FSD172.VT2": "peer_at2",
    "peer_at2/elCentro.AT2": "peer_at2",
    "sac/20190706031952.CJ.T001230.HNE.sac": "sac",
    "sac/20190706031952.CJ.T001230.HNN.sac": "sac",
    "sac/20190706031952.CJ.T001230.HNZ.sac": "sac",
    "sac/NGA.RSN1482..HGR.SAC": "sac",
    "sac/NGA.RSN1482..HGT.SAC": "sac",
    "smc/0111a.smc": "smc",
    "smc/0165a_u.smc": "smc",
    "smc/np01002p_4225a_a.smc": "smc",
    "text/CHV1-20140203E.txt": "acceleration_text",
    "text/tabasFN.txt": "acceleration_text",
    "csmip/ce14196p.zip": "",
    "miniseed/CI.CLC.xml": "",
}


def files_of(folder: str, ending: str = "") -> list[str]:
    """Return the names (with the folder) of the files in a folder that a format claims."""
    return [
        name
        for name, known in CLAIMED.items()
        if known and name.startswith(f"{folder}/") and name.endswith(ending)
    ]
