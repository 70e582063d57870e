#include "page/live_page.hpp"

#include "page/live_parts.hpp"
#include "viewer/html.hpp"
#include "viewer/page_parts.hpp"

namespace seastitch {
namespace {

constexpr PagePart kLiveScriptPart{kLiveScript, kLiveScriptSha256};

}  // namespace

const std::string& LivePage() {
  static const std::string page = FillTemplate(kLiveHtml,
                                               {{"style", PageStyle().text},
                                                {"viewer", ViewerSection()},
                                                {"viewer_script", ViewerScript().text},
                                                {"script", kLiveScriptPart.text}});
  return page;
}

const std::string& LivePagePolicy() {
  static const std::string policy = ContentPolicy(
      {ViewerScript(), kLiveScriptPart}, PageStyle(), "connect-src 'self'; frame-ancestors 'none'");
  return policy;
}

}  // namespace seastitch
