#pragma once

namespace seastitch {

// report.html as a template of FillTemplate(). Values whose names begin with `has_` are conditions.
constexpr const char* kReportPage = R"(<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width"><meta http-equiv="Content-Security-Policy" content="{{policy}}"><title>{{title}}</title><style>{{style}}</style></head><body>
<h1>{{title}}</h1>
<p class="small">{{head}}</p>
<div class="banner {{banner}}">{{statement}}</div>
{{#warnings}}<div class="banner bad">Warnings<ul>
{{warnings}}</ul></div>
{{/warnings}}{{#has_map}}<div class="tiles">
{{tiles}}</div>
{{#has_viewer}}{{viewer}}<p class="small" id="viewer-problem"></p>
{{/has_viewer}}<div id="pictures">
{{#has_overlap}}<h2>Swath mismatch</h2>
<div class="pair">
{{#corrected}}<figure><a href="{{mismatch_before}}"><img src="{{mismatch_before}}" alt="As navigated"></a><figcaption>As navigated</figcaption></figure>
{{/corrected}}<figure><a href="{{mismatch}}"><img src="{{mismatch}}" alt="Delivered map"></a><figcaption>Delivered map</figcaption></figure>
</div>
{{/has_overlap}}<h2>Depth</h2>
<div class="pair">
{{#corrected}}<figure><a href="{{depth_before}}"><img src="{{depth_before}}" alt="As navigated"></a><figcaption>As navigated</figcaption></figure>
{{/corrected}}<figure><a href="{{depth}}"><img src="{{depth}}" alt="Delivered map"></a><figcaption>Delivered map</figcaption></figure>
</div>
</div>
{{/has_map}}{{#advice}}<h2>What to do</h2>
<p class="small">The survey contradicts these values of its configuration by more than four sigma. This map is corrected
for what its mounting table has; a corrected file makes the next one right from its beginning.</p>
{{advice}}{{/advice}}<details{{figures_open}}><summary>All figures</summary>
{{before_after}}{{survey}}{{#has_map}}<p class="small">Both measures have one value [m] per cell with points of two or more submaps: the largest over pairs of
submaps. The swath mismatch, which the pictures show, is the mean distance from the points of one submap to the surface
of the other. It does not depend on the spacing of points. The consistency error is the mean distance to the nearest
points of the other (Roman and Singh, 2006). Before and after are compared over the cells with the same number of submaps in both
maps. Both pictures have the same colour scale.{{#has_truth}} Errors with respect to the truth are horizontal, along the
delivered track. Shape errors are those after the best-fitting rigid motion of the track.{{/has_truth}} Loop closures make
a map consistent. By themselves they do not make its absolute position more accurate.</p>
{{/has_map}}{{#s44}}{{s44}}<p class="small">Swath mismatch of the delivered map against the vertical uncertainty that S-44 allows: a mismatch
is the difference of two soundings, and counts as within up to &radic;2 TVU. It shows how well soundings repeat, not
an error that they share, such as a tide. Software does not certify a survey.</p>
{{/s44}}</details>
{{#has_map}}{{#mounting}}<h2>Mounting</h2>
<p class="small">Mounting errors: true value minus the value in vehicle.yaml. All submaps of a dive share them; each dive
has its own. The graph estimates them together with the submaps' poses, and this map is corrected for them. If a value is many sigma from zero, correct
vehicle.yaml and replay:</p>
<ul class="small">
<li>Add the first two to position_m of mbes. A latency (times speed) or a pitch angle (times altitude) also shifts the
soundings forward or back; a patch test distinguishes them.</li>
<li>Subtract the angle from the yaw of mbes. If the DVL is known to have the wrong angle, add it to the yaw of dvl
instead.</li>
<li>An error larger than sonar_mounting_sigma_m is estimated too small, and one several times as large is not estimated at
all. Raise that key then.</li>
</ul>
{{mounting}}{{/mounting}}<h2>Noise</h2>
<p>{{noise_findings}}</p>
{{#noise}}<p class="small">Estimated from the height differences that remain where submaps overlap. The covariance of every loop
closure is computed from these values. A time offset of the sonar is estimated from changes of the measured slope from
ping to ping with the roll rate (or, where the seabed slopes along the track, of the depth with the pitch rate).</p>
{{noise}}{{/noise}}{{#calibration}}<h2>Calibration</h2>
{{calibration}}{{/calibration}}{{#dives}}<h2>Dives</h2>
<ul>
{{dives}}</ul>
{{/dives}}<h2>Loop closures</h2>
{{#has_closure_errors}}<p>With respect to the truth, the normalised squared errors of the {{closures}} accepted closures
add up to {{chi2}}, with {{degrees_of_freedom}} degrees of freedom; the largest is {{worst_chi2}}. With consistent
covariances the first two are about equal, and one closure in a thousand (of rank 3) is above 16.</p>
{{/has_closure_errors}}{{verdicts}}<details><summary>Every registration</summary>
{{loops}}</details>
{{/has_map}}{{#navigation}}<h2>Navigation</h2>
{{navigation}}{{/navigation}}{{#refused}}<h2>Rejected input</h2>
<details><summary>Counters</summary>
{{refused}}</details>
{{/refused}}{{#mapper}}<h2>Mapper</h2>
<details><summary>Counters</summary>
{{mapper}}</details>
{{/mapper}}<p class="small">Beside this page: {{files}}</p>
{{#has_viewer}}<script type="application/json" id="map-data">{{map_data}}</script>
<script>{{viewer_script}}</script>
{{/has_viewer}}</body></html>
)";

}  // namespace seastitch
